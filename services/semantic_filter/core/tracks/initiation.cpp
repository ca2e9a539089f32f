#include "services/semantic_filter/core/tracks/initiation.h"

#include <ceres/tiny_solver.h>

#include <algorithm>
#include <cmath>

#include "common/base/algorithms/stable_sort.h"
#include "common/math/gaussian.h"
#include "common/math/so3.h"
#include "services/semantic_filter/core/association/box_explanation.h"
#include "services/semantic_filter/core/belief/mixture_ops.h"
#include "services/semantic_filter/core/tracks/mixture_reduction.h"
#include "services/semantic_filter/core/update/azimuth_update.h"
#include "services/semantic_filter/core/update/ground_contact.h"

namespace perdure::semantic_filter {

namespace {

struct YawStart {
  double yaw, sigma, weight;
};

/// Returns four starts that cover a half turn, because a cuboid is the same when turned by 180°.
/// Returns one start if the class has no yaw.
ScratchVector<YawStart> yawStarts(const ClassPrior& prior, const FrameContext& frame,
                                  const Eigen::Vector3d& ray) {
  const Eigen::Vector3d level = levelling(frame.view.up_W) * ray;
  const double bearing = std::atan2(level.y(), level.x());
  if (!prior.has_yaw) return {{bearing, 1.0, 1.0}};
  ScratchVector<YawStart> starts;
  for (int i = 0; i < 4; ++i) starts.push_back({wrapAngle(bearing + i * M_PI / 4), 0.39, 0.25});
  return starts;
}

void addMovingCopy(Track& track, const Hypothesis& at_rest, const ClassPrior& prior, double share) {
  if (share <= 0.0 || prior.speed_sigma <= 0.0) return;
  Hypothesis copy = at_rest;
  track.hypotheses.back().weight *= 1.0 - share;
  copy.weight *= share;
  copy.moving = true;
  const Eigen::Vector2d along(std::cos(copy.x[kYaw]), std::sin(copy.x[kYaw]));
  const double s2 = prior.speed_sigma * prior.speed_sigma;
  copy.P.block<2, 2>(kVelocity, kVelocity) =
      s2 * along * along.transpose() + 0.04 * s2 * Eigen::Matrix2d::Identity();
  copy.P(kVelocity + 2, kVelocity + 2) = 0.04;
  track.hypotheses.push_back(copy);
}

/// Updates the yaw starts of one class by the azimuth and weighs them. The total weight of the
/// class stays. The azimuth counts half, because a single one may be far off.
void weighByAzimuth(ScratchVector<Hypothesis>& fits, const BoxDetection& detection,
                    const ClassPrior& prior, const FrameContext& frame) {
  if (!detection.azimuth || !prior.has_yaw) return;
  const double sigma = azimuthSigma(detection.azimuth_sigma, prior);
  double before = 0.0, after = 0.0;
  for (auto& h : fits) {
    before += h.weight;
    h.weight *= updateWithAzimuth(h, *detection.azimuth, sigma, 0.5, frame);
    after += h.weight;
  }
  for (auto& h : fits) h.weight *= after > 0.0 ? before / after : 1.0;
}

/// Returns the log-likelihood ratio of the box's shape to log-uniform clutter. It is computed from
/// the ratio of width to height and the cost of the fit; if a side is cut, from the cost only.
double logShapeRatio(const CuboidFit& fit, const ClassPrior& prior, double yaw_sigma,
                     const BoxDetection& detection, const FrameContext& frame) {
  const auto& z = detection.z;
  const auto box = projectObserved(fit.hypothesis.x, frame.projector(),
                                   frame.styleOf(fit.hypothesis.class_name));
  const bool whole = z.count() == 4 && box &&
                     std::all_of(box->exact.begin(), box->exact.end(), [](bool e) { return e; });
  if (!whole) return -fit.cost;
  using Row = Eigen::Matrix<double, 1, kFree>;
  const Row by_state = (box->H.row(2) - box->H.row(0)).head<kFree>() / z.width() -
                       (box->H.row(3) - box->H.row(1)).head<kFree>() / z.height();
  Eigen::Matrix<double, kFree, kFree> P = Eigen::Matrix<double, kFree, kFree>::Zero();
  P(kYaw, kYaw) = yaw_sigma * yaw_sigma;
  P.block<3, 3>(kSize, kSize) = prior.log_size_covariance;
  P.bottomRightCorner<4, 4>().diagonal() =
      biasSigma(viewWalkOf(frame).lasting, z.width(), z.height()).cwiseAbs2();
  const double noise = (z.variance[0] + z.variance[2]) / std::pow(z.width(), 2) +
                       (z.variance[1] + z.variance[3]) / std::pow(z.height(), 2);
  const double variance = (by_state * P).dot(by_state) + noise;
  const CameraModel& camera = *frame.view.camera;
  const double range =
      std::log(std::max(camera.width(), camera.height()) / frame.parameters->clutter.min_size_px);
  return -fit.cost - 0.5 * std::log(2.0 * M_PI * variance) + std::log(range);
}

/// Updates `h` by the ground. Returns the likelihood ratio of its underside to clutter; 1 if the
/// ground is unknown.
double groundRatio(Hypothesis& h, const FrameContext& frame) {
  const double log_ratio = updateWithGround(h, 0, frame);
  if (log_ratio == 0.0) return 1.0;
  const CameraModel& camera = *frame.view.camera;
  const double distance = (h.x.head<3>() - frame.view.T_WC().p).norm();
  const double span = camera.height() * distance / camera.fy();
  return std::exp(log_ratio) * std::max(span / frame.parameters->ground.span_m, 1.0);
}

void addClass(Track& track, const ClassPrior& prior, double ratio, const BoxDetection& detection,
              const ScratchVector<YawStart>& starts, const std::optional<RangeHint>& range,
              const FrameContext& frame) {
  ScratchVector<Hypothesis> fits;
  for (const auto& start : starts) {
    const auto fit = fitCuboid(detection, prior, start.yaw, start.sigma, range, frame);
    if (!fit) continue;
    fits.push_back(fit->hypothesis);
    const double part = frame.parameters->box.partial_view;
    const double shape = std::exp(logShapeRatio(*fit, prior, start.sigma, detection, frame));
    const double ground = groundRatio(fits.back(), frame);
    fits.back().weight = ratio * start.weight * (part + (1.0 - part) * shape) * ground;
  }
  weighByAzimuth(fits, detection, prior, frame);
  for (const auto& h : fits) {
    if (h.weight < 1e-15) continue;
    track.hypotheses.push_back(h);
    addMovingCopy(track, h, prior, frame.moverShare(prior));
  }
}

/// Adds *other* with three starts of size, so that each Gaussian is narrow enough for a linear
/// model of the depth.
void addOther(Track& track, double ratio, const BoxDetection& detection, const Eigen::Vector3d& ray,
              const std::optional<RangeHint>& range, const FrameContext& frame) {
  constexpr double kScales[3] = {-1.2, 0.0, 1.2};
  ClassPrior prior = frame.priors->other;
  const Eigen::Vector3d middle = prior.log_size;
  for (const double scale : kScales) {
    prior.log_size = middle.array() + scale;
    addClass(track, prior, ratio / 3.0, detection, yawStarts(prior, frame, ray), range, frame);
  }
}

struct Candidate {
  ClassPrior prior;
  double log_weight;
};

ScratchVector<Candidate> candidates(const BoxDetection& detection, const FrameContext& frame) {
  ScratchVector<Candidate> all;
  for (const auto& name : frame.model->classes) {
    ClassPrior prior = frame.priors->of(name);
    prior.name = name;
    all.push_back({prior, std::log(prior.frequency) + logRatio(detection, *frame.model, name)});
  }
  stableSortBy(all, [](const Candidate& c) { return -c.log_weight; });
  const auto& initiation = frame.parameters->initiation;
  const auto limit = static_cast<std::size_t>(initiation.max_classes);
  if (all.size() > limit) all.resize(limit);
  const double floor =
      all.empty() ? 0.0 : all.front().log_weight + std::log(initiation.class_ratio);
  std::erase_if(all, [&](const auto& c) { return c.log_weight < floor; });
  return all;
}

/// Returns the factor by which frequencies become probabilities of classes, times the number of
/// classes. That number is there because a network's score already contains the share of its class.
double weightOfFrequency(const FrameContext& frame) {
  const auto& classes = frame.model->classes;
  double sum = 0.0;
  for (const auto& name : classes) sum += frame.priors->of(name).frequency;
  return static_cast<double>(classes.size()) / std::max(sum, 1e-9);
}

/// Returns the prior of *other*, times the number of classes.
double weightOfOther(const FrameContext& frame) {
  return static_cast<double>(frame.model->classes.size()) * frame.parameters->clutter.other_prior;
}

/// Censors the sides beside nearer boxes, because the object may continue behind these.
BoxDetection censoredBesideNearer(BoxDetection detection) {
  for (std::size_t i = 0; i < 4; ++i) {
    detection.z.measured[i] = detection.z.measured[i] && !detection.beside_nearer[i];
  }
  return detection;
}

/// Sets existence from the weights, normalises them, and enters the reasons of both in the ledger.
void bookInitiation(Track& track, const ScratchVector<Candidate>& kept,
                    const BoxDetection& detection, const FrameContext& frame) {
  const double odds = frame.parameters->initiation.odds;
  double ratio = 0.0;
  for (const auto& h : track.hypotheses) ratio += h.weight;
  ratio *= odds;
  track.existence = {odds / (1.0 + odds), ExistenceEvidence::kPrior, track.as_of};
  track.existence.become(ratio / (1.0 + ratio), ExistenceEvidence::kHit, track.as_of);
  const double other = frame.parameters->clutter.other_prior;
  double frequency = 0.0, activation_of_all = 0.0;
  for (const auto& c : kept) frequency += c.prior.frequency;
  ClassNumbers prior = {{kOtherClass, std::log(other)}};
  ClassNumbers activation = {{kOtherClass, detection.log_ratio_other}};
  for (const auto& c : kept) {
    prior.push_back({c.prior.name, std::log((1.0 - other) * c.prior.frequency / frequency)});
    activation.push_back({c.prior.name, c.log_weight - std::log(c.prior.frequency)});
  }
  for (std::size_t i = 0; i < activation.size(); ++i) {
    activation_of_all += std::exp(prior[i].value + activation[i].value);
  }
  for (auto& s : activation) s.value -= std::log(activation_of_all);
  normalise(track, ClassEvidence::kGeometry);
  track.classes.shift(ClassEvidence::kGeometry, ClassEvidence::kPrior, prior);
  track.classes.shift(ClassEvidence::kGeometry, ClassEvidence::kActivation, activation);
}

/// Whether two boxes of one frame overlap so much that the detector reported one object twice.
bool sameObject(const BoxMeasurement& a, const BoxMeasurement& b) {
  const Box box_a{a.sides[0], a.sides[1], a.sides[2], a.sides[3]};
  const Box box_b{b.sides[0], b.sides[1], b.sides[2], b.sides[3]};
  return intersectionOverUnion(box_a, box_b) > 0.65;
}

/// Whether the box is the rest of a confirmed object that is almost out of the image.
bool leavesView(BoxExplanations& expected, const Belief& belief,
                const ScratchVector<TrackVisibility>& visibilities, const BoxDetection& box) {
  if (box.z.count() == 4) return false;  // the border cuts an object that leaves
  for (std::size_t j = 0; j < visibilities.size(); ++j) {
    if (visibilities[j].state != Visibility::kOutOfView || !belief.tracks[j].life.confirmed)
      continue;
    if (expected.fit(j, visibilities[j].hidden_sides, box)) return true;
  }
  return false;
}

}  // namespace

double logInitiationRatio(const BoxDetection& detection, const FrameContext& frame) {
  const auto& p = *frame.parameters;
  double sum = 0.0;
  for (const auto& name : frame.model->classes) {
    sum += frame.priors->of(name).frequency * std::exp(logRatio(detection, *frame.model, name));
  }
  const double named = (1.0 - p.clutter.other_prior) * sum * weightOfFrequency(frame);
  return std::log(p.initiation.odds) - detection.log_partial_views +
         std::log(named + weightOfOther(frame) * std::exp(detection.log_ratio_other));
}

std::optional<Track> initiate(const BoxDetection& detection, const std::optional<RangeHint>& range,
                              TimePoint now, const FrameContext& frame) {
  const auto ray = centreRay(detection.z, frame.view);
  if (!ray) return std::nullopt;
  const auto kept = candidates(detection, frame);
  const BoxDetection seen = censoredBesideNearer(detection);
  Track track;
  const double named = (1.0 - frame.parameters->clutter.other_prior) * weightOfFrequency(frame);
  for (const auto& c : kept) {
    addClass(track, c.prior, named * std::exp(c.log_weight), seen, yawStarts(c.prior, frame, *ray),
             range, frame);
  }
  addOther(track, weightOfOther(frame) * std::exp(detection.log_ratio_other), seen, *ray, range,
           frame);
  if (track.hypotheses.empty()) return std::nullopt;
  track.life.first_seen = track.life.last_seen = track.as_of = now;
  track.pose_product = frame.pose_error.product;
  track.history.first_box = track.history.last_box = AssignedBox{now, detection.z.box()};
  track.life.hits = 1;
  track.classes_considered = frame.model->names;
  bookInitiation(track, kept, detection, frame);
  track.lookalike.nats = detection.log_ratio_best;
  track.views.detected_from = track.views.observed_from = {frame.view.T_WC(), 1.0};
  track.views.predicted_from = frame.view.T_WC();
  return track;
}

bool reinitialise(Track& track, const ClassNumbers& pmf, const BoxDetection& detection,
                  const std::optional<RangeHint>& range, const FrameContext& frame) {
  auto initiated = initiate(detection, range, track.as_of, frame);
  if (!initiated) return false;
  const auto shares = classShares(*initiated);
  std::vector<Hypothesis> known;
  double of_known = 0.0;
  for (const auto& c : pmf) {
    const auto now = std::find_if(shares.begin(), shares.end(),
                                  [&](const ClassNumber& s) { return s.name == c.name; });
    if (c.name == kOtherClass || now == shares.end()) continue;
    of_known += c.value;
    for (const auto& h : initiated->hypotheses) {
      if (h.class_name != c.name) continue;
      known.push_back(h);
      known.back().weight *= c.value / now->value;
    }
  }
  if (of_known > 0.5) {
    track.hypotheses = std::move(known);
  } else {
    track.hypotheses = std::move(initiated->hypotheses);
  }
  track.batch = {};
  track.history.running_nis = 1.0;
  normalise(track, ClassEvidence::kGeometry);
  return true;
}

void initiateTracks(Belief& belief, const ScratchVector<TrackVisibility>& visibilities,
                    const Eigen::VectorXd& explained, const FrameInput& input,
                    const FrameContext& frame, IdBook& ids) {
  const auto& boxes = *input.boxes;
  ScratchVector<Track> initiated;
  BoxExplanations expected(belief, input, *frame.parameters);
  ScratchVector<std::size_t> accepted;
  for (std::size_t z = 0; z < boxes.size(); ++z) {
    if (explained[static_cast<Eigen::Index>(z)] > frame.parameters->initiation.explained)
      accepted.push_back(z);
  }
  for (std::size_t z = 0; z < boxes.size(); ++z) {
    const BoxDetection& e = boxes[z];
    if (explained[static_cast<Eigen::Index>(z)] > frame.parameters->initiation.explained) continue;
    if (logInitiationRatio(e, frame) - std::log(frame.parameters->initiation.odds) <
        frame.parameters->initiation.min_log_ratio) {
      continue;
    }
    const bool duplicate = std::any_of(accepted.begin(), accepted.end(), [&](std::size_t other) {
      return sameObject(boxes[other].z, e.z);
    });
    if (duplicate || leavesView(expected, belief, visibilities, e)) continue;
    auto track = initiate(e, rangeFromLandmarks(e, input.points, frame.parameters->initiation),
                          input.stamp.time, frame);
    if (!track) continue;
    track->id = ids.idFor(input.stamp.sequence, z);
    if (const double share = explained[static_cast<Eigen::Index>(z)]; share > 0.0) {
      track->existence.become(track->existence * (1.0 - share), ExistenceEvidence::kShared,
                              input.stamp.time);
    }
    reduceMixture(*track, frame);
    if (track->hypotheses.empty()) continue;
    initiated.push_back(std::move(*track));
    accepted.push_back(z);
  }
  std::move(initiated.begin(), initiated.end(), std::back_inserter(belief.tracks));
  const auto older = [](const auto& a, const auto& b) { return a.id < b.id; };
  if (!std::is_sorted(belief.tracks.begin(), belief.tracks.end(), older)) {
    stableSortBy(belief.tracks, [](const Track& o) { return o.id; });
  }
}

}  // namespace perdure::semantic_filter
