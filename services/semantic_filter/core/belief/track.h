// A track: the belief about one object, as a plain value (eq. 9: existence x PMF x a bank of
// Gaussians). The bank is a mixture over (class, static or moving, mode). Derivation:
// tools/docs/maths/state_and_mixture.md.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "common/base/shared_vector.h"
#include "common/types/detections.h"
#include "common/types/objects.h"
#include "common/types/odometry.h"
#include "services/semantic_filter/core/belief/detection_rate.h"
#include "services/semantic_filter/core/belief/ledger.h"
#include "services/semantic_filter/core/belief/state.h"
#include "services/semantic_filter/core/parameters.h"

namespace perdure::semantic_filter {

/// A track that was out of the image for longer than this begins another visit when it returns.
inline constexpr double kAnotherVisit_s = 1.0;

/// Published lifecycle of the track: confirmation, times and counts of detections.
struct Lifecycle {
  bool confirmed = false;
  bool once_confirmed = false;  ///< it was confirmed at some time, so the map has it
  bool recalled = false;        ///< recalled from the map and not detected since
  bool detected_on_revisit = false;
  TimePoint first_seen, last_seen;
  TimePoint visit_began;  ///< time at which the track last came back into the image
  std::uint32_t hits = 0, visible_misses = 0;

  /// Adds the lifecycle of another track of the same object.
  void merge(const Lifecycle& other);
};

/// A box that was assigned to the track, pixels.
struct AssignedBox {
  TimePoint time;
  Box box;
};

struct DetectionHistory {
  /// One bit for each of the last 64 frames with detections, the same frames for all tracks.
  std::uint64_t visible = 0, detected = 0;
  double recent_share = 1.0;             ///< share of the latest observations that were detections
  double existence_when_detected = 0.0;  ///< existence after the latest detection
  double running_nis = 1.0;              ///< normalised innovation of its boxes, per dimension
  std::optional<AssignedBox> first_box, last_box;  ///< empty after a recall

  void add(bool is_visible, bool is_detected) {
    visible = visible << 1 | (is_visible ? 1U : 0U);
    detected = detected << 1 | (is_detected ? 1U : 0U);
  }
  void merge(const DetectionHistory& other);
};

/// The camera pose of an observation, and how many observations share its errors.
struct Viewpoint {
  RigidTransform T_WC;
  double observations = 0.0;  ///< discounted by the change of view
};

struct Viewpoints {
  Viewpoint detected_from;                       ///< of the latest detection
  Viewpoint observed_from;                       ///< of the latest observation
  std::optional<RigidTransform> predicted_from;  ///< T_WC that b and Detectability refer to

  void merge(const Viewpoints& other);
};

/// Evidence about the logarithm of the size at which P_D is halved, at the value that was used.
struct SizeEvidence {
  double gradient = 0.0, information = 0.0;  ///< of the log likelihood; Fisher's information

  SizeEvidence& operator+=(const SizeEvidence& more);
};

/// Causes of a P_D of this track that differs from that of its class.
struct Detectability {
  double unmapped_occluder = 0.0;  ///< probability that something not on the map hides the object
  double hard_to_detect = 0.0;     ///< that nothing hides it, but it is seldom detected from here
  Directions seen_from = Directions::Zero();  ///< in W, on earlier visits
  Directions seen_now = Directions::Zero();   ///< in W, on this visit
  SizeEvidence missed;  ///< of the misses since the last detection; the object may be gone
  SizeEvidence proven;  ///< of detections, and of misses before them; not yet learned from
  DetectionRate rate;   ///< how often earlier visits detected it, by view
};

/// Evidence that the network reports an object of no known class as a known class.
struct Lookalike {
  double nats = 0.0;       ///< that it resembles a known class, if it is of none
  std::string class_name;  ///< the latest known class that the network reported; empty: none
};

/// One observation that is stored for the batch; core/smoothing defines it.
struct Keyframe;

/// The evidence of a track that BoxExtents has counted.
struct CountedExtent {
  std::uint64_t model = 0;
  double nats = 0.0;  ///< for outlines
};

struct BatchState {
  SharedVector<std::shared_ptr<const Keyframe>> keyframes;  ///< in order of time
  /// False for a track that came from the map, because later keyframes lack its earlier evidence.
  bool complete = true;
  std::uint32_t fresh = 0;            ///< keyframes since the latest fit
  std::uint32_t seen = 0;             ///< keyframes since there were enough for a fit
  std::uint32_t mode_search_due = 0;  ///< modes are searched when `seen` reaches it
  std::uint32_t patience = 1;         ///< factor by which fits are rarer while they change little
  CountedExtent extent;
};

struct PublishedVisibility {
  Visibility state = Visibility::kVisible;
  double fraction = 1.0;
  ObjectId blocked_by = 0;
};

/// Frames without evidence since the track was last predicted. They change no published value.
struct UnusedFrames {
  LedgerEntry occluded, out_of_view;

  std::uint64_t count() const { return occluded.count + out_of_view.count; }
};

struct Track {
  TrackId id = 0;
  Existence existence;
  /// Log-odds of "it is a real object" minus those of "it is still there"
  /// (tools/docs/maths/class_and_existence_update.md).
  double existence_lead = 0.0;
  SharedVector<Hypothesis> hypotheses;  ///< not empty, the heaviest first
  TimePoint as_of;                      ///< time of the state
  ClassAccount classes;                 ///< the reasons of the hypotheses' weights
  /// Classes of the models that have observed it; null for a track that came from the map.
  std::shared_ptr<const std::set<std::string>> classes_considered;
  Lookalike lookalike;
  Lifecycle life;
  DetectionHistory history;
  Viewpoints views;
  Detectability detectability;
  BatchState batch;
  PublishedVisibility visibility;
  Matrix6d pose_product = Matrix6d::Identity();  ///< PoseError::product at as_of
  UnusedFrames unused;

  const Hypothesis& best() const { return hypotheses.front(); }
};

/// Returns the upper limit of the existence probability. It lets later misses lower the existence.
double existenceCeiling(const Track& track, const TrackParameters& parameters);

}  // namespace perdure::semantic_filter
