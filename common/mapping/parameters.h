// Parameters of anchors, of the pose graph and of loops.
#pragma once

#include <cstdint>

namespace perdure::mapping {

struct AnchorParameters {
  double distance_m = 12.0;
  double turn_rad = 0.5236;
  double yaw_sigma_rad = 0.0026;
  /// Assumed random walk of poses without increments.
  double walk_position = 0.03;  ///< m/√m
  double walk_yaw = 0.0005;     ///< rad/√m
};

/// Search for the body among the objects of the map.
struct PlaceParameters {
  double pair_least_m = 4.0, pair_most_m = 40.0;  ///< distance between the objects of a proposing
                                                  ///< pair
  double gate_sigmas = 4.0;                       ///< gate of the search, in standard deviations of
                                                  ///< the prior
  double known_share = 0.5;      ///< probability that an object at the mapped trajectory is on the
                                 ///< map
  double known_within_m = 20.0;  ///< σ of the decrease of known_share with distance from the
                                 ///< trajectory
};

struct GraphParameters {
  double kernel = 13.3;  ///< χ² (4 degrees of freedom, .99) above which the weight of a loop
                         ///< decreases
  std::int64_t iterations = 10;
};

/// Conditions for search and acceptance of loops, and for recall.
struct LoopParameters {
  double visit_m = 100.0;      ///< distance travelled after which a new visit begins
  double fresh_m = 30.0;       ///< at least one object must have been detected within this distance
  double view_m = 60.0;        ///< range of the anchors whose objects are searched
  double search_each_m = 0.5;  ///< distance travelled between two searches
  /// Distance travelled between searches, and least number of objects, if the body's position on
  /// the map is unknown.
  double elsewhere_each_m = 4.0;
  std::uint64_t least_elsewhere = 4;
  /// A session is joined if two searches agree, at a distance travelled between them in this range.
  double agree_after_m = 8.0, agree_within_m = 60.0;
  /// Around the place where the odometry lost its frame of reference, one search suffices if its
  /// log-likelihood ratio against chance exceeds this value plus the log of the number of poses.
  double at_once_nats = 15.0;
  double nats = 8.0;       ///< least score above the second best pose, plus log(PlaceMatch::cells)
  double near_m = 1.6;     ///< deviation of the body's position below which near_nats applies
  double near_nats = 2.5;  ///< replaces nats below near_m
  /// A match farther from the expected position needs `nats` and two pairs, because that position
  /// was not known well (χ² with 4 degrees of freedom, .99).
  double far_chi2 = 13.3;
  double far_m = 2.5;  ///< above this deviation four objects are required
  /// A tie needs least_tracked objects observed again under their old ids. The standard deviation
  /// of its position must be at most tracked_gain times that by the graph.
  std::uint64_t least_tracked = 2;
  double tracked_gain = 0.7;
  /// An accepted loop closure is retracted if the graph rejects it over withdraw_after_m of travel.
  /// A tentative one is dropped after give_up_after_m if no others agree with it.
  double withdraw_after_m = 8.0, give_up_after_m = 60.0;
  double floor_m = 0.1, floor_rad = 0.005;  ///< least standard deviation of a loop
  /// An object is recalled if the standard deviations of its pose relative to the body are below
  /// these.
  double hold_back_m = 1.0, hold_back_rad = 0.035;
};

struct DriftScaleParameters {
  /// Median of the scale before any loop, and σ of its logarithm. The median is below 1, because
  /// the assumed walk is an upper value: a walk that is too small leads to wrong associations.
  double prior_median = 1.0 / 3.0, prior_sigma = 1.0;
  /// Quantiles of the posterior of the scale: `quantile` for use after a loop, `most` for the
  /// widest search.
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
