#include "services/semantic_filter/core/smoothing/keyframes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/scratch.h"
#include "services/semantic_filter/core/parameters.h"

namespace perdure::semantic_filter {
namespace {

using Keyframes = std::vector<std::shared_ptr<const Keyframe>>;

/// The view of an object in one keyframe, by which keyframes are compared.
struct KeyframeView {
  ViewRay ray;
  Eigen::Vector2d centre;  ///< of the box, rad
  double log_height;
};

KeyframeView keyframeViewOf(const Eigen::Vector3d& place, const Keyframe& k) {
  const Eigen::Vector2d centre(k.z.sides[0] + k.z.sides[2], k.z.sides[1] + k.z.sides[3]);
  return {viewRayOf(place, k.from->T_WC), 0.5 * centre / k.from->camera.fx(),
          std::log(k.z.height())};
}

/// Returns the larger of two changes, in correlation lengths: that of the view and that of the box.
double changeBetween(const KeyframeView& a, const KeyframeView& b, const ViewScales& scales) {
  return std::max(viewChange(a.ray, b.ray, scales),
                  (a.centre - b.centre).norm() / scales.image_angle +
                      std::abs(a.log_height - b.log_height) / scales.log_distance);
}

/// Returns the keyframe most similar to another. It is never the newest, because a moving object is
/// estimated at the time of the newest.
std::size_t mostSimilar(const Eigen::Vector3d& place, const Keyframes& all,
                        const ViewScales& scales) {
  ScratchVector<KeyframeView> views;
  views.reserve(all.size());
  for (const auto& k : all) views.push_back(keyframeViewOf(place, *k));
  ScratchVector<double> least_change(all.size(), std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const double change = changeBetween(views[i], views[j], scales);
      least_change[i] = std::min(least_change[i], change);
      least_change[j] = std::min(least_change[j], change);
    }
  }
  return static_cast<std::size_t>(std::min_element(least_change.begin(), least_change.end() - 1) -
                                  least_change.begin());
}

void thin(const Eigen::Vector3d& place, Keyframes& all, const ViewScales& scales,
          std::size_t limit) {
  while (all.size() > limit) {
    all.erase(all.begin() + static_cast<std::ptrdiff_t>(mostSimilar(place, all, scales)));
  }
}

}  // namespace

bool addKeyframe(Track& track, Keyframe keyframe, const ViewScales& scales,
                 const SmoothingParameters& parameters) {
  const Eigen::Vector3d place = track.best().x.head<3>();
  const KeyframeView now = keyframeViewOf(place, keyframe);
  const auto same = [&](const auto& other) {
    return changeBetween(keyframeViewOf(place, *other), now, scales) < parameters.new_view;
  };
  // Begins with the newest: it is usually the most similar.
  const Keyframes& known = track.batch.keyframes.read();
  if (std::any_of(known.rbegin(), known.rend(), same)) return false;
  Keyframes& all = track.batch.keyframes.write(kMostKeyframes + 1);
  all.push_back(std::make_shared<const Keyframe>(std::move(keyframe)));
  thin(place, all, scales, static_cast<std::size_t>(parameters.keyframes));
  return true;
}

bool explains(const Hypothesis& h, const Keyframe& keyframe, const FrameContext& frame) {
  const FrameView& from = *keyframe.from;
  State cuboid = h.x;
  cuboid.segment<4>(kBias).setZero();
  const auto box =
      projectObserved(cuboid, from.projector, frame.stylesOf(from).of(h.class_name), h.heading());
  if (!box) return false;
  const auto H = box->H.leftCols<kGeometry>();
  Eigen::Matrix4d S = H * h.P.topLeftCorner<kGeometry, kGeometry>() * H.transpose() +
                      box->H_pose * from.error.covariance * box->H_pose.transpose();
  S.diagonal() += keyframe.z.lasting;
  const auto score = scoreBox(keyframe.z, *box, S, keyframe.hidden, frame.parameters->box);
  return score && score->nis < gates::kForeignBox;
}

void mergeBatches(Track& a, const Track& b, const ViewScales& scales,
                  const SmoothingParameters& parameters) {
  a.batch.complete = a.batch.complete && b.batch.complete;
  Keyframes& all = a.batch.keyframes.write();
  all.insert(all.end(), b.batch.keyframes.begin(), b.batch.keyframes.end());
  std::stable_sort(all.begin(), all.end(),
                   [](const auto& x, const auto& y) { return x->from->time < y->from->time; });
  thin(a.best().x.head<3>(), all, scales, static_cast<std::size_t>(parameters.keyframes));
}

}  // namespace perdure::semantic_filter
