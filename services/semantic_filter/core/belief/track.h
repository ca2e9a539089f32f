// The belief about one track as a plain value: existence × PMF × bank of Gaussians (eq. 9).
// Beyond the paper, the bank is a mixture over (class, static or moving, yaw or scale mode): the
// PMF over classes and the probability of moving are sums of the weights of its hypotheses.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/base/shared_vector.h"
#include "common/types/detections.h"
#include "common/types/objects.h"
#include "common/types/odometry.h"
#include "services/semantic_filter/core/belief/detection_rate.h"
#include "services/semantic_filter/core/belief/ledger.h"
#include "services/semantic_filter/core/belief/state.h"
#include "services/semantic_filter/core/parameters.h"

namespace perdure::semantic_filter {

/// From where the track was last looked at, for the correlation of looks (DESIGN 5, item 7).
struct Viewpoint {
  RigidTransform T_WC;
  double observations = 0.0;  ///< number of looks that share this view, discounted
};

/// A box that was surely the track's, pixels.
struct AssignedBox {
  TimePoint time;
  Box box;
};

/// Out of the picture, not behind something, for so long: what comes next is another visit.
inline constexpr double kAnotherVisit_s = 1.0;

/// Of the last 64 frames that heard detections, a bit each: whether the track was in visibility,
/// and whether it was found. Bits of one belief are of the same frames.
struct DetectionHistory {
  std::uint64_t visible = 0, detected = 0;

  void add(bool is_visible, bool is_detected) {
    visible = visible << 1 | (is_visible ? 1U : 0U);
    detected = detected << 1 | (is_detected ? 1U : 0U);
  }
};

struct Keyframe;

struct Track {
  ObjectId id = 0;
  Existence existence;
  SharedVector<Hypothesis> hypotheses;  ///< not empty, the heaviest first
  bool confirmed = false;
  bool once_confirmed = false;  ///< it was; hence the map knows it
  TimePoint first_seen, last_seen, as_of;
  Matrix6d pose_product = Matrix6d::Identity();  ///< PoseError::product that C refers to
  TimePoint visit_began;                         ///< when it last came back into the picture
  TimePoint drift_measured_at;                   ///< when it last told of the pose's error
  bool detected_on_revisit = false;              ///< detected on another visit than the first
  std::uint32_t hits = 0, visible_misses = 0;
  double running_nis = 1.0;  ///< per degree of freedom, of the boxes it claimed
  std::optional<AssignedBox> first_box, last_box;  ///< none of one that came back
  Viewpoint detected_from;                         ///< of the last look that showed it
  Viewpoint observed_from;                         ///< of the last look, whatever it showed
  /// Log-odds by which "it is a real thing" is above "it is there still"
  /// (core/updateClassAndExistence.cpp).
  double real_over_present = 0.0;
  double lookalike_nats =
      0.0;  ///< nats for "looks like a known class", if it is of none (logRatio)
  std::string lookalike_class;  ///< the class that the network last saw in it; "" where none
  double unmapped_occluder =
      0.0;  ///< probability that something not on the map hides it, if it exists
  double hard_to_detect = 0.0;  ///< that nothing does, and the network seldom finds it from here
  std::optional<RigidTransform> predicted_from;  ///< T_WC that those and b refer to
  DetectionRate detection_rate;
  DetectionHistory history;
  double recent_detection_share = 1.0;   ///< share of late visible looks that showed it
  double existence_when_detected = 0.0;  ///< existence after the last look that showed it
  Visibility visibility = Visibility::kVisible;
  double visible_fraction = 1.0;
  ObjectId blocked_by = 0;
  bool recalled = false;
  /// KeyframeBatch that are remembered, in order of time.
  SharedVector<std::shared_ptr<const Keyframe>> keyframes;
  /// False for one that came back (restart, recall): what it knew before is in its state alone, and
  /// an estimate from the looks since then would lose it.
  bool keyframes_complete = true;
  std::uint32_t new_keyframes = 0;    ///< that came since the state was last map_fit
  std::uint32_t keyframes_seen = 0;   ///< since there were enough to smooth
  std::uint32_t mode_search_due = 0;  ///< so many, other modes are sought
  std::uint32_t refit_patience = 1;   ///< grows while smoothing finds little to mend
  /// Classes that the models which saw it could name; none of one that came back.
  std::shared_ptr<const std::set<std::string>> classes_considered;
  ClassAccount
      classes;  ///< why the hypotheses updateClassAndExistence what they updateClassAndExistence
  std::vector<ClassNumber> context;  ///< nats, laid over what is published (core/context.h)
  /// KeyframeBatch that were not used since the track was last brought up to date: nothing of what
  /// is published changes while it is hidden, its ledger neither.
  LedgerEntry occluded_frames, out_of_view_frames;

  const Hypothesis& best() const { return hypotheses.front(); }
};

/// The most that is believed of its existence.
double existenceCeiling(const Track& track, const TrackParameters& parameters);

}  // namespace perdure::semantic_filter
