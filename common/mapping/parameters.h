// Parameters of anchors, of the pose graph and of loops.
#pragma once

#include <cstdint>

namespace perdure::mapping {

struct AnchorParameters {
  double distance_m = 12.0;
  double turn_rad = 0.5236;
  double yaw_sigma_rad = 0.0026;
  /// Random walk of poses without increments.
  double walk_position = 0.03;  ///< m/√m
  double walk_yaw = 0.0005;     ///< rad/√m
};

/// Search for the body among the objects of the map.
struct PlaceParameters {
  double pair_least_m = 4.0, pair_most_m = 40.0;  ///< distance between the objects of a proposing
                                                  ///< pair
  double gate_sigmas = 4.0;                       ///< gate, in standard deviations of the prior
  double known_share = 0.5;      ///< probability that an object near the trajectory is on the map
  double known_within_m = 20.0;  ///< σ of its Gaussian decay with distance from the trajectory
};

struct GraphParameters {
  double kernel = 13.3;  ///< χ² (4 degrees of freedom, .99) above which a loop's weight decreases
  std::int64_t iterations = 10;
};

/// Conditions for search and acceptance of loops, and for recall.
struct LoopParameters {
  double visit_m = 100.0;      ///< distance travelled after which a new visit begins
  double fresh_m = 30.0;       ///< an object must have been detected within this distance
  double view_m = 60.0;        ///< range of the anchors whose objects are searched
  double search_each_m = 0.5;  ///< distance travelled between two searches
  /// Distance between searches, and least number of objects, if the place of the body on the map is
  /// unknown.
  double elsewhere_each_m = 4.0;
  std::uint64_t least_elsewhere = 4;
  /// A session is joined if two searches agree. The distance travelled between them must be in this
  /// range.
  double agree_after_m = 8.0, agree_within_m = 60.0;
  /// Around the place where the odometry lost its frame of reference one search suffices at this
  /// log-likelihood ratio against chance, beyond that of the number of poses.
  double at_once_nats = 15.0;
  double nats = 8.0;       ///< least score above the second best pose, beyond the prior's
  double near_m = 1.6;     ///< deviation of the body's position below which near_nats applies
  double near_nats = 2.5;  ///< least score of the assignment of objects, in place of nats
  /// A match farther from that position needs `nats`, because the position was not known that well
  /// (χ² with 4 degrees of freedom, .99).
  double far_chi2 = 13.3;
  double far_m = 2.5;      ///< above this deviation four objects are required
  /// Least number of objects observed again under their old ids that link the body to earlier
  /// places. The second value is the largest deviation of the resulting position, as a fraction of
  /// that by the graph.
  std::uint64_t least_tracked = 2;
  double tracked_gain = 0.7;
  /// An accepted loop closure that the graph rejects over this distance is retracted. A tentative
  /// loop waits up to the second distance for others that agree.
  double withdraw_after_m = 8.0, give_up_after_m = 60.0;
  double floor_m = 0.1, floor_rad = 0.005;  ///< least standard deviation of a loop
  /// An object is recalled if its pose relative to the body is known better than this.
  double hold_back_m = 1.0, hold_back_rad = 0.035;
};

struct DriftScaleParameters {
  /// Median of the scale before any loop, and σ of its logarithm. The assumed walk is an upper
  /// value, since one that is too small leads to wrong associations.
  double prior_median = 1.0 / 3.0, prior_sigma = 1.0;
  /// Quantiles of the scale: of the one in use after a loop, and of the widest search.
  double quantile = 0.8, most = 0.98;
};

struct Parameters {
  DriftScaleParameters drift_scale;
  AnchorParameters anchor;
  PlaceParameters place;
  GraphParameters graph;
  LoopParameters loop;
};

}  // namespace perdure::mapping
