#include "services/semantic_filter/core/visibility/predicted_box.h"

#include <algorithm>
#include <cmath>

#include "services/semantic_filter/core/belief/mixture_ops.h"
#include "services/semantic_filter/core/belief/motion_model.h"

namespace perdure::semantic_filter {

constexpr double kPredictionFloor = 0.05;  // r·π·v below which inference gets no prediction
constexpr double kFastest = 1e5;           // px/s; a faster side passes close to the lens
constexpr double kLeastSigma = 1;          // px
constexpr double kFarthest = 1e5;  // px; a side further away is of an object beside the camera

std::optional<Prediction> predictionOf(const Track& track, const FrameInput& now,
                                       const std::optional<ComingFrame>& coming) {
  const Hypothesis& best = track.best();
  const double probability =
      track.existence * classProbability(track, best.class_name) * track.visibility.fraction;
  if (probability < kPredictionFloor) return std::nullopt;
  const double since = toSeconds(now.stamp.time - track.as_of);
  const BoxStyle& style = now.styles()->of(best.class_name);
  const auto box = projectObserved(stateAt(best, since), now.view, style, best.heading());
  if (!box || !(box->sides.cwiseAbs().maxCoeff() < kFarthest)) return std::nullopt;
  if (box->sides[0] >= box->sides[2] || box->sides[1] >= box->sides[3]) return std::nullopt;
  const Eigen::Vector4d& s = box->sides;
  Prediction prediction{track.id, best.class_name, Box{s[0], s[1], s[2], s[3]}, probability};
  const Eigen::Matrix4d S = predictedCovariance(best, *box, now.pose_error.covariance);
  for (int i = 0; i < 4; ++i) {
    prediction.side_sigma[i] = std::max(kLeastSigma, std::sqrt(std::max(S(i, i), 0.0)));
  }
  if (!coming) return prediction;
  const auto next =
      projectObserved(stateAt(best, since + coming->seconds), coming->view, style, best.heading());
  if (!next || !next->sides.allFinite()) return prediction;
  for (int i = 0; i < 4; ++i) {
    const double speed = (next->sides[i] - box->sides[i]) / coming->seconds;
    prediction.velocity[i] = std::clamp(speed, -kFastest, kFastest);
  }
  return prediction;
}

}  // namespace perdure::semantic_filter
