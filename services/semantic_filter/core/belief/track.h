// The belief about one object as a plain value: existence × PMF × bank of Gaussians (eq. 9).
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

/// From where the object was last looked at, for the correlation of looks (DESIGN 5, item 7).
struct ViewPoint {
  RigidTransform T_WC;
  double looks = 0.0;  ///< number of looks that share this view, discounted
};

/// A box that was surely the object's, pixels.
struct OwnBox {
  TimePoint time;
  Box box;
};

/// Out of the picture, not behind something, for so long: what comes next is another visit.
inline constexpr double kAnotherVisit_s = 1.0;

/// Of the last 64 frames that heard detections, a bit each: whether the object was in sight, and
/// whether it was found. Bits of one belief are of the same frames.
struct Sightings {
  std::uint64_t in_sight = 0, found = 0;

  void add(bool is_in_sight, bool is_found) {
    in_sight = in_sight << 1 | (is_in_sight ? 1U : 0U);
    found = found << 1 | (is_found ? 1U : 0U);
  }
};

struct Keyframe;

struct Object {
  ObjectId id = 0;
  Existence existence;
  SharedVector<Hypothesis> hypotheses;  ///< not empty, the heaviest first
  bool confirmed = false;
  bool once_confirmed = false;  ///< it was; hence the map knows it
  TimePoint first_seen, last_seen, as_of;
  Matrix6d pose_product = Matrix6d::Identity();  ///< PoseError::product that C refers to
  TimePoint came_back;                           ///< when it last came back into the picture
  TimePoint told_pose;                           ///< when it last told of the pose's error
  bool found_again = false;                      ///< detected on another visit than the first
  std::uint32_t hits = 0, visible_misses = 0;
  double running_nis = 1.0;                   ///< per degree of freedom, of the boxes it claimed
  std::optional<OwnBox> first_box, last_box;  ///< none of one that came back
  ViewPoint hit_view;                         ///< of the last look that showed it
  ViewPoint late_view;                        ///< of the last look, whatever it showed
  /// Log-odds by which "it is a real thing" is above "it is there still" (core/weigh.cpp).
  double lead = 0.0;
  double alike = 0.0;     ///< nats for "looks like a known class", if it is of none (logRatio)
  std::string resembles;  ///< the class that the network last saw in it; "" where none
  double screened = 0.0;  ///< probability that something not on the map hides it, if it exists
  double elusive = 0.0;   ///< that nothing does, and the network seldom finds it from here
  std::optional<RigidTransform> last_view;  ///< T_WC that those and b refer to
  FoundRate found_rate;
  Sightings sightings;
  double support = 1.0;         ///< share of late visible looks that showed it
  double seen_existence = 0.0;  ///< existence after the last look that showed it
  Visibility visibility = Visibility::kVisible;
  double visible_fraction = 1.0;
  ObjectId blocked_by = 0;
  bool recalled = false;
  /// Looks that are remembered, in order of time.
  SharedVector<std::shared_ptr<const Keyframe>> keyframes;
  /// False for one that came back (restart, recall): what it knew before is in its state alone, and
  /// an estimate from the looks since then would lose it.
  bool remembers_all = true;
  std::uint32_t fresh_keyframes = 0;     ///< that came since the state was last smoothed
  std::uint32_t remembered = 0;          ///< since there were enough to smooth
  std::uint32_t seek_modes_at = 0;       ///< so many, other modes are sought
  std::uint32_t smoothing_patience = 1;  ///< grows while smoothing finds little to mend
  /// Classes that the models which saw it could name; none of one that came back.
  std::shared_ptr<const std::set<std::string>> asked;
  ClassAccount classes;              ///< why the hypotheses weigh what they weigh
  std::vector<ClassNumber> context;  ///< nats, laid over what is published (core/context.h)
  /// Looks that were not used since the object was last brought up to date: nothing of what is
  /// published changes while it is hidden, its ledger neither.
  LedgerEntry hidden, away;

  const Hypothesis& best() const { return hypotheses.front(); }
};

/// The most that is believed of its existence.
double certainty(const Object& object, const TendParameters& parameters);

}  // namespace perdure::semantic_filter
