#include "services/semantic_filter/core/update/track_update.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "common/math/gaussian.h"
#include "services/semantic_filter/core/belief/mixture_ops.h"
#include "services/semantic_filter/core/update/azimuth_update.h"
#include "services/semantic_filter/core/update/ekf.h"
#include "services/semantic_filter/core/visibility/detectability.h"

namespace perdure::semantic_filter {

namespace {

Shares sharesOf(const HypothesisScore& h, const ScratchVector<std::size_t>& gated,
                const EtaRow& eta) {
  Shares shares;
  shares.A = h.no_box;
  shares.box.reserve(gated.size());
  for (std::size_t i = 0; i < gated.size(); ++i) {
    const double free = eta[static_cast<Eigen::Index>(gated[i])];
    shares.box.push_back(h.detection_probability * free * h.matches[i].likelihood);
    shares.A += shares.box.back();
  }
  for (auto& b : shares.box) b /= shares.A;
  shares.none = h.no_box / shares.A;
  return shares;
}

void updateState(Hypothesis& h, const Shares& shares, const TrackScore& score,
                 const HypothesisScore& scored, const std::vector<BoxDetection>& boxes,
                 double repetition, const FrameContext& frame) {
  const ProjectedBox* at_prior = scored.predicted ? &scored.predicted->box : nullptr;
  thread_local std::vector<Hypothesis> parts;
  parts.clear();
  for (std::size_t i = 0; i < shares.box.size(); ++i) {
    if (shares.box[i] < kNegligible) continue;
    const BoxMeasurement& z = boxes[score.boxes[i]].z;
    auto hidden = withSidesBesideNearer(score.visibility.hidden_sides, boxes[score.boxes[i]]);
    const int part = scored.matches[i].part;
    if (part >= 0) hidden[static_cast<std::size_t>(part)] = true;
    parts.push_back(updateWithBox(h, z, hidden, repetition, frame, at_prior));
    parts.back().weight = shares.box[i];
  }
  if (parts.empty()) return;
  const double weight = h.weight;
  mix(h, shares.none, parts);
  h.weight = weight;
}

/// Returns the probability that one of the boxes is the track's, if its object exists.
double probabilityDetected(const Track& track, const AllShares& shares) {
  double detected = 0.0, total = 0.0;
  for (std::size_t i = 0; i < shares.size(); ++i) {
    const double weight = track.hypotheses[i].weight * shares[i].A;
    detected += weight * (1.0 - shares[i].none);
    total += weight;
  }
  return total > 0.0 ? detected / total : 0.0;
}

/// Returns the assigned box, an index into TrackScore::boxes; nothing if no box has a share of at
/// least kAssigned.
std::optional<std::size_t> assignedBox(const Track& track, const AllShares& shares) {
  constexpr double kAssigned = 0.8;
  double total = 0.0;
  ScratchVector<double> box(shares.empty() ? 0 : shares.front().box.size(), 0.0);
  for (std::size_t i = 0; i < shares.size(); ++i) {
    const double weight = track.hypotheses[i].weight * shares[i].A;
    total += weight;
    for (std::size_t z = 0; z < box.size(); ++z) box[z] += weight * shares[i].box[z];
  }
  const auto best = std::max_element(box.begin(), box.end());
  if (best == box.end() || *best < kAssigned * total || total <= 0.0) return std::nullopt;
  return static_cast<std::size_t>(best - box.begin());
}

void count(Track& track, double detected, const AllShares& shares, const TrackScore& score) {
  const double visible = std::min(1.0, score.visibility.fraction);
  track.history.recent_share += 0.25 * visible * (detected - track.history.recent_share);
  if (detected < 0.5) {
    ++track.life.visible_misses;
    return;
  }
  ++track.life.hits;
  const bool from_map =
      track.life.recalled && toSeconds(track.as_of - track.life.last_seen) > kAnotherVisit_s;
  track.life.detected_on_revisit =
      track.life.detected_on_revisit || from_map || track.life.visit_began > track.life.first_seen;
  track.life.recalled = false;
  track.life.last_seen = track.as_of;
  const auto& box = shares.front().box;
  const auto z = std::max_element(box.begin(), box.end()) - box.begin();
  if (!box.empty() && box[z] > 0.5) {
    track.history.running_nis =
        0.85 * track.history.running_nis +
        0.15 * score.hypotheses.front().matches[static_cast<std::size_t>(z)].nis;
  }
}

void countForDetectionRate(Track& track, const TrackScore& score, bool is_detected,
                           const FrameContext& frame) {
  const ViewRay from = viewRayOf(track.best().x.head<3>(), frame.view.T_WC());
  track.detectability.rate.add(from, score.hypotheses.front().expected, is_detected,
                               detectabilityScales(frame.parameters->visibility));
}

/// Stores the direction of a detection. If the object moves, removes all directions.
void countDirection(Track& track, const RigidTransform& T_WC) {
  Directions& seen_from = track.detectability.seen_now;
  const Hypothesis& best = track.best();
  const Eigen::Vector3d ray = best.x.head<3>() - T_WC.p;
  if (best.moving) {
    seen_from.setZero();
    track.detectability.seen_from.setZero();
  } else {
    addDirection(seen_from, std::atan2(ray.y(), ray.x()), ray.norm());
  }
}

/// Counts an observation of a confirmed object at rest for the size at which P_D is halved. A miss
/// counts only after a later detection.
void countForDetectionSize(Track& track, const TrackScore& score, bool detected, double exponent,
                           const FrameContext& frame) {
  const auto& predicted = score.hypotheses.front().predicted;
  const double whole = frame.parameters->visibility.full;
  if (!track.life.once_confirmed || track.best().moving || !predicted) return;
  if (score.visibility.fraction < whole) return;
  const Eigen::Vector4d& sides = predicted->box.sides;
  const double size = std::sqrt((sides[2] - sides[0]) * (sides[3] - sides[1]));
  SizeEvidence evidence =
      sizeEvidence(frame.priors->of(track.best().class_name), size, detected, frame);
  evidence.gradient *= exponent, evidence.information *= exponent;
  Detectability& d = track.detectability;
  d.missed += evidence;
  if (detected) d.proven += std::exchange(d.missed, {});
}

/// Returns the exponent of an observation between rest and motion, `seconds` after the last one. It
/// is below 1, because errors of consecutive boxes are correlated and a velocity can fit them.
double motionExponent(double seconds) {
  // Correlation of a tracker's boxes on KITTI: .6, .44, .3 and .13 after .1, .2, .3 and .5 s.
  constexpr double kCorrelation = 0.8, kSeconds = 0.3;
  const double correlation = kCorrelation * std::exp(-std::max(seconds, 0.0) / kSeconds);
  return (1.0 - correlation) / (1.0 + correlation);
}

/// Tempering of an observation, for the hypothesis with the largest posterior.
struct Tempering {
  double exponent = 1.0;
  double observations = 0.0;  ///< number of earlier ones with correlated errors
};

Tempering temperingOf(const Track& track, const TrackScore& score, const AllShares& shares,
                      double correlation) {
  std::size_t best = 0;
  const auto posterior = [&](std::size_t i) { return track.hypotheses[i].weight * shares[i].A; };
  for (std::size_t i = 1; i < shares.size(); ++i) {
    if (posterior(i) > posterior(best)) best = i;
  }
  const double observations = score.hypotheses[best].correlated_observations;
  return {temperingExponent(observations, correlation), observations};
}

/// Mean of A over the hypotheses, with tempering between classes and without.
struct MeanA {
  double tempered = 0.0, full = 0.0;
};

/// Weight of a group of hypotheses, and the weighted sum of their A.
struct Group {
  double weight = 0.0, sum = 0.0;
  void add(double w, double A) { weight += w, sum += w * A; }
  double A() const { return weight > 0.0 ? sum / weight : 0.0; }
  /// Returns the factor on the weights by which the mean A of the group counts with an exponent.
  double temper(double exponent) const { return A() > 0.0 ? std::pow(A(), exponent - 1.0) : 0.0; }
};

/// Exponents of one observation between hypotheses of different classes or motions.
struct Exponents {
  double classes = 1.0, motion = 1.0;
};

/// Updates the weights: π ∝ π A. A counts in full among hypotheses that differ by geometry only,
/// and with its exponents between rest and motion of a class and between classes. Returns the prior
/// means of A.
MeanA updateWeights(Track& track, const AllShares& shares, const Exponents& tempering) {
  struct Class {
    Group all, motion[2];
  };
  ScratchMap<std::string_view, Class> classes;
  for (std::size_t i = 0; i < shares.size(); ++i) {
    const Hypothesis& h = track.hypotheses.read()[i];
    Class& c = classes[h.class_name];
    c.all.add(h.weight, shares[i].A);
    c.motion[h.moving].add(h.weight, shares[i].A);
  }
  MeanA mean;
  for (const auto& [name, c] : classes) {
    mean.full += c.all.sum;
    mean.tempered += c.all.weight * std::pow(c.all.A(), tempering.classes);
  }
  for (std::size_t i = 0; i < shares.size(); ++i) {
    Hypothesis& h = track.hypotheses[i];
    const Class& c = classes[h.class_name];
    double tempered = 0.0;  // so that the sum of the class stays w_c Ā_c^τ
    for (const Group& m : c.motion) tempered += m.sum * m.temper(tempering.motion);
    const double same = tempered > 0.0 ? c.all.sum / tempered : 0.0;
    h.weight *= shares[i].A * c.motion[h.moving].temper(tempering.motion) * same *
                c.all.temper(tempering.classes);
  }
  return mean;
}

/// Protects yaw modes that a mode search has weighed by all keyframes, because later observations
/// alone could end true modes. A mode whose A is comparable to the best keeps at least the share
/// `least` of its class. The weight of the class stays.
void keepSearchedModes(std::vector<Hypothesis>& hs, const AllShares& shares, double least) {
  constexpr double kComparable = 0.05;  // least ratio to the largest A of the class
  struct Class {
    double before = 0.0, after = 0.0, best_A = 0.0;
  };
  ScratchMap<std::string_view, Class> classes;
  for (std::size_t i = 0; i < hs.size(); ++i) {
    Class& c = classes[hs[i].class_name];
    c.before += hs[i].weight;
    c.best_A = std::max(c.best_A, shares[i].A);
  }
  for (std::size_t i = 0; i < hs.size(); ++i) {
    Hypothesis& h = hs[i];
    Class& c = classes[h.class_name];
    const bool kept = h.modes_searched && !h.moving && shares[i].A > kComparable * c.best_A;
    if (kept) h.weight = std::max(h.weight, least * c.before);
    c.after += h.weight;
  }
  for (auto& h : hs) {
    const Class& c = classes[h.class_name];
    if (c.after > c.before) h.weight *= c.before / c.after;
  }
}

/// Existence has two log-odds; the smaller one counts. "It is a real object": observations from one
/// viewpoint share the mistakes of the network, hits as well as misses, so A counts with the
/// exponent τ. "It is still there": a patch of wall that resembles a chair does not go away, so A
/// counts in full, and one hit shows that the misses before it were mistakes of the network.
double existenceAfter(Track& track, const MeanA& mean_A, double certain) {
  const auto logOdds = [](double p) { return std::log(p / (1.0 - p)); };
  const double most = logOdds(certain), now = logOdds(std::min<double>(track.existence, certain));
  const double real =
      std::min(now + std::max(track.existence_lead, 0.0) + std::log(mean_A.tempered), most);
  const double still =
      std::min(now - std::min(track.existence_lead, 0.0) + std::log(mean_A.full), most);
  track.existence_lead = real - still;
  return 1.0 / (1.0 + std::exp(-std::min(real, still)));
}

/// Updates PMF, existence and detectability by one observation, from the same A. `detected`: a box
/// is probably the track's. Leaves the weights unnormalised. Returns the new existence, at most
/// `existenceCeiling`.
double updateClassAndExistence(Track& track, const AllShares& shares, const Exponents& tempering,
                               bool detected, const Parameters& parameters) {
  const MeanA mean_A = updateWeights(track, shares, tempering);
  if (detected)
    keepSearchedModes(track.hypotheses.write(), shares, parameters.smoothing.least_weight);
  updateDetectability(track, mean_A.full, parameters.visibility.hard_detection_share);
  return existenceAfter(track, mean_A, existenceCeiling(track, parameters.tracks));
}

/// Whether a box that is probably another track's fits the best hypothesis, also by its class.
bool anotherHasItsBox(const TrackScore& score, const EtaRow& eta) {
  constexpr double kFits = 2.37;  // normalised innovation of four sides, 95 %
  constexpr double kOthers = 0.5;
  const auto& matches = score.hypotheses.front().matches;
  for (std::size_t z = 0; z < score.boxes.size(); ++z) {
    const double free = eta[static_cast<Eigen::Index>(score.boxes[z])];
    if (free < kOthers && matches[z].likelihood > 1.0 && matches[z].nis < kFits) return true;
  }
  return false;
}

}  // namespace

double noiseRepetition(const Track& track, const FrameContext& frame) {
  if (track.views.detected_from.observations <= 0.0) return 1.0;
  const double scale = frame.parameters->box.noise_view;
  const double correlation =
      viewCorrelation(track.best().x.head<3>(), track.views.detected_from.T_WC, frame.view.T_WC(),
                      {scale, scale, 0.5 * scale});
  return (1.0 + correlation) / std::max(1.0 - correlation, 1e-6);
}

std::optional<std::size_t> update(Track& track, const TrackScore& score, const EtaRow& eta,
                                  const std::vector<BoxDetection>& boxes,
                                  const FrameContext& frame) {
  if (score.visibility.fraction <= 0.0) return std::nullopt;
  AllShares shares;
  shares.reserve(score.hypotheses.size());
  for (const auto& h : score.hypotheses) shares.push_back(sharesOf(h, score.boxes, eta));
  const double detected = probabilityDetected(track, shares);
  // Two objects cannot stand in one place, so another track's box is no evidence against this one.
  if (track.life.recalled && detected < 0.5 && anotherHasItsBox(score, eta)) return std::nullopt;
  const Tempering tempering =
      temperingOf(track, score, shares, frame.parameters->tempering.correlation);
  const auto assigned = assignedBox(track, shares);
  const double since_last = toSeconds(track.as_of - track.life.last_seen);
  count(track, detected, shares, score);
  const double repetition = noiseRepetition(track, frame);
  for (std::size_t i = 0; i < shares.size(); ++i) {
    updateState(track.hypotheses[i], shares[i], score, score.hypotheses[i], boxes, repetition,
                frame);
  }
  const UpdateReasons reasons = reasonsOf(track, shares, detected, tempering.exponent,
                                          tempering.exponent, score.boxes, boxes, frame);
  const double r = track.existence;
  double next =
      updateClassAndExistence(track, shares, {tempering.exponent, motionExponent(since_last)},
                              detected >= 0.5, *frame.parameters);
  if (detected >= 0.5) {
    track.history.existence_when_detected = next;
  } else if (score.top_down) {  // an answer raises existence at most to its value at the last hit
    next = std::min(next, std::max(r, track.history.existence_when_detected));
  }
  bookExistence(track, next, reasons);
  if (!score.top_down && !track.best().moving)
    countForDetectionRate(track, score, detected >= 0.5, frame);
  if (!score.top_down)
    countForDetectionSize(track, score, detected >= 0.5, tempering.exponent, frame);
  updateAzimuths(track, shares, tempering.exponent, score.boxes, boxes, frame);
  if (assigned) {
    const BoxDetection& box = boxes[score.boxes[*assigned]];
    track.history.last_box = AssignedBox{track.as_of, box.z.box()};
    track.lookalike.nats += tempering.exponent * box.log_ratio_best;
    track.lookalike.class_name = classSeenIn(box, *frame.model);
  }
  if (detected >= 0.5) {
    track.views.detected_from = {frame.view.T_WC(), 1.0 + tempering.observations};
    if (sound(track)) countDirection(track, frame.view.T_WC());
  }
  if (detected >= 0.5 || !score.top_down) {  // a top-down answer is no observation
    track.views.observed_from = {frame.view.T_WC(),
                                 tempering.observations + std::min(1.0, score.visibility.fraction)};
  }
  if (sound(track)) bookClasses(track, reasons);
  return assigned ? std::optional(score.boxes[*assigned]) : std::nullopt;
}

Track updateAsMissed(Track track, TrackScore score, const FrameContext& frame) {
  score.boxes.clear();
  update(track, score, Eigen::RowVectorXd(), {}, frame);
  return track;
}

}  // namespace perdure::semantic_filter
