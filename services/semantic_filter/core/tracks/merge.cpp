#include "services/semantic_filter/core/tracks/merge.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/base/scratch.h"
#include "common/math/gaussian.h"
#include "common/math/so3.h"
#include "services/semantic_filter/core/belief/classes/upper_part.h"
#include "services/semantic_filter/core/belief/mixture_ops.h"
#include "services/semantic_filter/core/measurement/polygon.h"
#include "services/semantic_filter/core/parameters.h"
#include "services/semantic_filter/core/smoothing/keyframes.h"
#include "services/semantic_filter/core/update/predict.h"

namespace perdure::semantic_filter {
namespace {

constexpr double kSurelyOne =
    0.6;  // overlap above which two boxes of one frame may be of one object
constexpr double kSameInImage = 0.6;  // intersection over union of two images of one object

bool isOther(const Track& o) { return o.best().class_name == kOtherClass; }

void multiplyPmf(Track& a, const Track& b) {
  for (auto& h : a.hypotheses) {
    h.weight *= std::max(classProbability(b, h.class_name), 1e-3);
  }
  normalise(a, ClassEvidence::kMerge);
}

/// Whether a track of a known class has enough hits to replace an *other* track. A track of a few
/// boxes, as at the border of the image, has not.
bool hasEnoughHits(const Track& known, const Track& other) {
  constexpr std::uint32_t kFewer = 4;  // times fewer hits
  return known.life.once_confirmed || kFewer * known.life.hits >= other.life.hits;
}

/// Whether two beliefs contradict each other, so that their mean would be wrong and too certain.
bool contradict(const Hypothesis& a, const Hypothesis& b) {
  constexpr double kTurned = 0.35;  // rad
  if (a.moving) return false;
  if (a.upper_part != b.upper_part) return true;
  const Vector7d d = geometryDifference(a, b);
  if (std::abs(d[kYaw]) > kTurned) return true;
  const Cholesky P(a.P.topLeftCorner<kGeometry, kGeometry>() +
                   b.P.topLeftCorner<kGeometry, kGeometry>());
  return !P.positive() || P.whiten(d).squaredNorm() > gates::kNoFusion;
}

/// Keeps the hypotheses of both tracks, weighted by their numbers of hits. Later observations
/// decide between them.
void keepBoth(Track& a, const Track& b) {
  const double share =
      static_cast<double>(b.life.hits) / std::max(1.0, double(a.life.hits) + double(b.life.hits));
  for (auto& h : a.hypotheses) h.weight *= 1.0 - share;
  for (Hypothesis h : b.hypotheses) {
    h.weight *= share;
    a.hypotheses.push_back(std::move(h));
  }
  normalise(a, ClassEvidence::kMerge);
}

/// Removes keyframes of a seldom detected track that the other track does not explain.
void forgetForeignKeyframes(Track& a, Track& b, const FrameContext& frame) {
  constexpr double kSeldomDetected = 0.2;  // share of recent observations
  Track& seldom_detected = a.history.recent_share < b.history.recent_share ? a : b;
  const Hypothesis& often_detected =
      (a.history.recent_share < b.history.recent_share ? b : a).best();
  if (seldom_detected.history.recent_share >= kSeldomDetected) return;
  std::erase_if(seldom_detected.batch.keyframes.write(),
                [&](const auto& k) { return !explains(often_detected, *k, frame); });
}

void absorb(Track& a, Track& b, const FrameContext& frame) {
  if (isOther(a) != isOther(b)) {
    if (isOther(a) && hasEnoughHits(b, a)) {
      a.hypotheses = b.hypotheses;
      a.classes = b.classes;
    }
  } else if (contradict(a.best(), b.best())) {
    forgetForeignKeyframes(a, b, frame);
    keepBoth(a, b);
  } else {
    const ClassPrior& prior = frame.priors->of(a.best().class_name);
    const double weight = a.best().weight;
    if (!a.best().moving) {  // velocities are not fused: a moving track keeps its state
      a.hypotheses.front() = fuse(a.best(), b.best(), prior, frame.pose_error.covariance);
    }
    a.hypotheses.front().weight = weight;
    multiplyPmf(a, b);
  }
  a.life.merge(b.life);
  a.existence.become(std::min(1.0 - (1.0 - a.existence) * (1.0 - b.existence),
                              existenceCeiling(a, frame.parameters->tracks)),
                     ExistenceEvidence::kMerge, a.as_of);
  a.history.merge(b.history);
  a.views.merge(b.views);
  a.detectability.seen_now = a.detectability.seen_now.cwiseMax(b.detectability.seen_now);
  a.detectability.seen_from = a.detectability.seen_from.cwiseMax(b.detectability.seen_from);
  a.detectability.missed = {};  // b had the boxes
  a.detectability.rate.join(b.detectability.rate,
                            detectabilityScales(frame.parameters->visibility));
  mergeBatches(a, b, biasScales(frame.parameters->box), frame.parameters->smoothing);
}

/// Whether two cuboids overlap so much in the image that they may be one object.
bool sameInImage(const State& a, const State& b, const Projector& from) {
  const auto box_a = projectCuboid(a, from), box_b = projectCuboid(b, from);
  if (!box_a || !box_b) return true;
  const auto toBox = [](const Eigen::Vector4d& s) { return Box{s[0], s[1], s[2], s[3]}; };
  return intersectionOverUnion(toBox(box_a->sides), toBox(box_b->sides)) > kSameInImage;
}

bool bothVisible(const Track& a, const Track& b) {
  return a.visibility.fraction > 0.0 && b.visibility.fraction > 0.0;
}

/// Whether a is visible and occludes b. b may then be a copy of a behind it.
bool occludes(const Track& a, const Track& b) {
  return a.visibility.fraction > 0.0 && b.visibility.state == Visibility::kOccluded &&
         b.visibility.blocked_by == a.id;
}

/// Predicts tracks that are not visible to the later of both times. Their states have the time of
/// their last observation.
void predictToSameTime(Track& a, Track& b, const FrameContext& frame) {
  const TimePoint now = std::max(a.as_of, b.as_of);
  for (Track* o : {&a, &b}) {
    if (o->visibility.fraction > 0.0) continue;
    predict(*o, now, frame.pose_error, frame.parameters->motion, viewWalkOf(frame));
  }
}

/// Whether the id of a survives that of b. The confirmed track survives, or else the older one.
bool survives(const Track& a, const Track& b) {
  if (a.life.once_confirmed != b.life.once_confirmed) return a.life.once_confirmed;
  return a.life.first_seen < b.life.first_seen ||
         (a.life.first_seen == b.life.first_seen && a.id < b.id);
}

struct SharedVolume {
  double of_joint = 0.0, of_lesser = 0.0;  ///< shared volume over joint and over lesser volume
};

SharedVolume sharedVolume(const State& a, const State& b, const Eigen::Vector3d& up_W) {
  const Eigen::Vector3d size_a = a.segment<3>(kSize).array().exp();
  const Eigen::Vector3d size_b = b.segment<3>(kSize).array().exp();
  const Eigen::Vector3d offset =
      uprightRotation(a[kYaw], up_W).transpose() * (b.head<3>() - a.head<3>());
  const double turn = b[kYaw] - a[kYaw];
  const Eigen::Matrix2d R = rotationAboutZ(turn).topLeftCorner<2, 2>();
  Polygon footprint;
  constexpr double kSigns[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
  for (const auto& s : kSigns) {
    footprint.push_back(offset.head<2>() +
                        R * Eigen::Vector2d(0.5 * s[0] * size_b.x(), 0.5 * s[1] * size_b.y()));
  }
  for (int axis = 0; axis < 2; ++axis) {
    footprint = clip(footprint, axis, -0.5 * size_a[axis], true);
    footprint = clip(footprint, axis, 0.5 * size_a[axis], false);
  }
  const double top = std::min(0.5 * size_a.z(), offset.z() + 0.5 * size_b.z());
  const double bottom = std::max(-0.5 * size_a.z(), offset.z() - 0.5 * size_b.z());
  const double shared = polygonArea(footprint) * std::max(top - bottom, 0.0);
  return {shared / (size_a.prod() + size_b.prod() - shared),
          shared / std::min(size_a.prod(), size_b.prod())};
}

/// Whether one frame detected both tracks, because two boxes of one frame are of two objects.
bool detectedTogether(const Track& a, const Track& b) {
  return (a.history.detected & b.history.detected) != 0;
}

/// Whether two visible tracks were detected in turns: never both, and kTurns times only one.
bool alternate(const Track& a, const Track& b) {
  constexpr int kTurns = 4;  // frames
  const DetectionHistory &of_a = a.history, &of_b = b.history;
  if (detectedTogether(a, b) || a.life.hits < 2 || b.life.hits < 2) return false;
  return std::popcount((of_a.detected ^ of_b.detected) & of_a.visible & of_b.visible) >= kTurns;
}

/// Whether two tracks are one object: they overlap in space and image; or overlap less and
/// alternate; or one is *other* and lies inside the other.
bool sameSpace(const Track& a, const Track& b, const FrameContext& frame) {
  const State &x = a.best().x, &y = b.best().x;
  const TrackParameters& parameters = frame.parameters->tracks;
  const SharedVolume shared = sharedVolume(x, y, frame.view.up_W);
  if (isOther(a) != isOther(b)) {
    if (shared.of_lesser > parameters.merge_inside) return true;
  } else {
    if (shared.of_joint < kSurelyOne && detectedTogether(a, b)) return false;
    if (shared.of_joint >= parameters.merge_turns && alternate(a, b)) return true;
  }
  return shared.of_joint >= parameters.merge_overlap && sameInImage(x, y, frame.projector());
}

/// Sphere around a track's cuboid. Spheres are stored in a separate list, because few pairs touch
/// and their test is most of the work.
struct Ball {
  Eigen::Vector3d centre;
  double radius;
  bool visible, recalled;
};

Ball ballOf(const Track& track) {
  const State& x = track.best().x;
  return {x.head<3>(), 0.5 * x.segment<3>(kSize).array().exp().matrix().norm(),
          track.visibility.fraction > 0.0, track.life.recalled};
}

bool touch(const Ball& a, const Ball& b) {
  const double reach = a.radius + b.radius;
  return (a.visible || b.visible || a.recalled != b.recalled) &&
         (a.centre - b.centre).squaredNorm() <= reach * reach;
}

/// Whether one track comes from the map and was not detected since, the other was detected, and
/// their relative position is known better than half the width of the narrower one.
bool metOnTheMap(const Track& a, const Track& b) {
  if (a.life.recalled == b.life.recalled) return false;
  const Hypothesis &x = a.best(), &y = b.best();
  const double variance = 0.5 * (x.P.topLeftCorner<2, 2>() + y.P.topLeftCorner<2, 2>()).trace();
  return std::sqrt(variance) < 0.5 * std::exp(std::min(x.x[kSize + 1], y.x[kSize + 1]));
}

bool mayMerge(const Track& a, const Track& b) {
  return bothVisible(a, b) || occludes(a, b) || occludes(b, a) || metOnTheMap(a, b);
}

}  // namespace

/// *Other* may prove to be the object of known class in the same place.
bool sameKind(const Track& a, const Track& b) {
  if (a.best().moving != b.best().moving) return false;
  return a.best().class_name == b.best().class_name || isOther(a) != isOther(b);
}

bool mayBeOne(const Track& a, const Track& b, const FrameContext& frame) {
  constexpr double kShared = 0.2;  // share of the lesser volume; merge_and_fusion.md, "Waiting"
  return sameKind(a, b) && !detectedTogether(a, b) &&
         sharedVolume(a.best().x, b.best().x, frame.view.up_W).of_lesser > kShared;
}

double overlap(const State& a, const State& b, const Eigen::Vector3d& up_W) {
  return sharedVolume(a, b, up_W).of_joint;
}

Hypothesis fuse(const Hypothesis& a, const Hypothesis& b, const ClassPrior& prior,
                const Matrix6d& P_pose) {
  // Given the pose error g the beliefs are x | g ~ N(x̂ + B g, P - B P_g Bᵀ) with B = C P_g⁻¹.
  const Eigen::Matrix<double, 7, 6> B_a = regressOn(P_pose, a.C.topRows<7>());
  const Eigen::Matrix<double, 7, 6> B_b = regressOn(P_pose, b.C.topRows<7>());
  const Matrix7d P_a = a.P.topLeftCorner<7, 7>() - B_a * P_pose * B_a.transpose();
  const Matrix7d P_b = b.P.topLeftCorner<7, 7>() - B_b * P_pose * B_b.transpose();
  if (!isCovariance(P_a) || !isCovariance(P_b)) return a;
  const Matrix7d J_a = inverseSymmetric(P_a);
  const Matrix7d J_b = inverseSymmetric(P_b);
  Matrix7d J_prior = Matrix7d::Zero();
  const SizePrior size = sizePriorOf(prior, a.upper_part);
  J_prior.block<3, 3>(kSize, kSize) = inverseSymmetric(size.covariance);
  Matrix7d J_new = J_b - J_prior;  // information of b without the prior, which a contains already
  if (eigenvalues(J_new).minCoeff() < 0.0) {
    J_new = 0.5 * J_b;  // the prior cannot be separated: half of b counts
    J_prior = 0.5 * J_b;
  }
  const Matrix7d P = inverseSymmetric(J_a + J_new);
  Vector7d prior_mean = Vector7d::Zero();  // relative to a
  prior_mean.segment<3>(kSize) = size.mean - a.x.segment<3>(kSize);
  const Vector7d d = geometryDifference(b, a);
  const Vector7d pull =
      J_new.isApprox(0.5 * J_b) ? Vector7d(J_new * d) : Vector7d(J_b * d - J_prior * prior_mean);
  Hypothesis fused = a;
  fused.ground_contact = {};
  fused.x.head<7>() += P * pull;
  fused.x[kYaw] = wrapAngle(fused.x[kYaw]);
  const Eigen::Matrix<double, 7, 6> B = P * (J_a * B_a + J_new * B_b);
  const Eigen::Matrix4d bias = a.P.block<4, 4>(kBias, kBias);
  fused.P.setZero();
  fused.P.block<4, 4>(kBias, kBias) = bias;
  fused.C.middleRows<4>(kBias).setZero();
  fused.P.topLeftCorner<7, 7>() = P + B * P_pose * B.transpose();
  fused.C.topRows<7>() = B * P_pose;
  makeSymmetric(fused.P);
  return isCovariance(fused.P.topLeftCorner<7, 7>()) && fused.x.allFinite() ? fused : a;
}

void mergeTwo(Track& a, Track& b, const FrameContext& frame) {
  predictToSameTime(a, b, frame);
  absorb(a, b, frame);
}

std::vector<MergeRecord> mergeObjects(std::vector<Track>& tracks, const FrameContext& frame) {
  std::vector<MergeRecord> merges;
  const ScratchScope scope;
  ScratchVector<Ball> balls;
  balls.reserve(tracks.size());
  for (const Track& o : tracks) balls.push_back(ballOf(o));
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    for (std::size_t j = i + 1; j < tracks.size();) {
      Track &a = tracks[i], &b = tracks[j];
      if (!touch(balls[i], balls[j]) || !mayMerge(a, b) || !sameKind(a, b) ||
          !sameSpace(a, b, frame)) {
        ++j;
        continue;
      }
      if (survives(b, a)) std::swap(a, b);
      mergeTwo(a, b, frame);
      merges.push_back({a.id, b.id});
      tracks.erase(tracks.begin() + static_cast<std::ptrdiff_t>(j));
      balls.erase(balls.begin() + static_cast<std::ptrdiff_t>(j));
      balls[i] = ballOf(tracks[i]);
    }
  }
  return merges;
}

}  // namespace perdure::semantic_filter
