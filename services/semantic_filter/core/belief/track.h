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
#include "services/semantic_filter/core/belief/shape.h"

namespace perdure::semantic_filter {

/// x = [p_WO, yaw about gravity, log l, log w, log h, b, v_W]. b is the detector's own error at
/// this object: how far it puts each side of the box (x1, y1, x2, y2) from the cuboid's image, in
/// widths and heights of the box; it stays while the view stays (DESIGN 5, item 7). v and its
/// covariance are zero while the hypothesis is a static one.
inline constexpr int kStateDim = 14;
using State = Eigen::Matrix<double, kStateDim, 1>;
using StateCovariance = Eigen::Matrix<double, kStateDim, kStateDim>;
using CrossPose = Eigen::Matrix<double, kStateDim, 6>;  ///< P_xg with the pose error [θ, p]
inline constexpr int kYaw = 3, kSize = 4, kBias = 7, kVelocity = 11;
inline constexpr int kGeometry = kBias;  ///< dimensions of the cuboid alone

/// What the looks at a thing alone say of the ground that it stands on (core/ground.h).
struct Footing {
  double above = 0.0;     ///< m, beside the underside of the hypothesis
  double variance = 0.0;  ///< m², given the pose; 0: they say nothing
};

struct Hypothesis {
  std::string class_name;
  bool moving = false;
  double weight = 0.0;  ///< of this hypothesis given that the object exists; they sum to 1
  State x = State::Zero();
  StateCovariance P = StateCovariance::Identity();
  CrossPose C = CrossPose::Zero();
  double head = 0.0;  ///< log-odds that the yaw is not turned by 180°
  double pace = 1.0;  ///< of a moving one: its speed's prior against the Gaussian it began with
  bool modes_sought = false;  ///< of yaw, and weighed by all looks that are remembered
  Footing footing = {};

  /// Shape::corner's, in expectation.
  double facing() const { return facingOf(head); }
};

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

/// π of a class: the sum of its hypotheses' weights.
double classProbability(const Object& object, const std::string& class_name);
/// Probability that a moving hypothesis is faster than `speed`, m/s.
double fasterThan(const Hypothesis& h, double speed);
/// Probability that the object moves faster than `min_speed`, given that it exists.
double movingProbability(const Object& object, double min_speed);
/// All numbers are finite and some weight is left.
bool sound(const Object& object);
/// π of each class, in the order of its heaviest hypothesis.
std::vector<ClassNumber> classShares(const Object& object);
/// Books the weights as they are now, whatever their sum.
void book(Object& object, ClassEvidence why);
/// Divides the weights by their sum, puts the heaviest first (stable), and books them.
void normalise(Object& object, ClassEvidence why);
/// a - b of the cuboids, yaw modulo 180°: a cuboid is the same turned by that.
Vector7d geometryDifference(const Hypothesis& a, const Hypothesis& b);
/// x ⊕ of a moment-matched pair: b is merged into a, weights added; yaw differences are wrapped.
void mergeInto(Hypothesis& a, const Hypothesis& b);
/// The published belief: per class its hypotheses as one Gaussian around the heaviest one.
ObjectBelief toBelief(const Object& object, double min_speed);
/// A belief that came back as an object with one hypothesis for each class. `back` is kRestore or
/// kRecall.
Object fromBelief(const ObjectBelief& belief, const Matrix6d& pose_product, ExistenceEvidence back);

}  // namespace perdure::semantic_filter
