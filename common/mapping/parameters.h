// Parameters of anchors, of the pose graph and of loops.
#pragma once

#include <cstdint>

namespace perdure::mapping {

struct AnchorParameters {
  double distance_m = 12.0;
  double turn_rad = 0.5236;
  double yaw_sigma_rad = 0.0026;
  /// Walk of poses that come without increments.
  double walk_position = 0.03;  ///< m/√m
  double walk_yaw = 0.0005;     ///< rad/√m
};

/// Of the search for the body among the objects of the map.
struct PlaceParameters {
  double pair_least_m = 4.0, pair_most_m = 40.0;  ///< between the objects of a proposing pair
  double gate_sigmas = 4.0;                       ///< of the prior
  double known_share = 0.5;      ///< of what stands where the body drove, the map has
  double known_within_m = 20.0;  ///< how far from there it falls to .6 of that
};

struct GraphParameters {
  double kernel = 13.3;  ///< χ² (4 degrees of freedom, .99) from which a loop's weight falls
  std::int64_t iterations = 10;
};

/// When a loop is searched and believed, and what is recalled.
struct LoopParameters {
  double visit_m = 100.0;      ///< driven since an object was detected: that was another visit
  double fresh_m = 30.0;       ///< something must have been detected on this way
  double view_m = 60.0;        ///< objects that the map has of anchors this far
  double search_each_m = 0.5;  ///< driven between two searches
  /// The same where nothing says where on the map the body is, and the objects that it takes.
  double elsewhere_each_m = 4.0;
  std::uint64_t least_elsewhere = 4;
  /// A session is joined where two searches agree that lie so much way apart, but no more.
  double agree_after_m = 8.0, agree_within_m = 60.0;
  /// Around the place where the odometry lost its frame of reference one search suffices, at this
  /// log-likelihood ratio against chance, beyond that of the number of ways.
  double at_once_nats = 15.0;
  double nats = 8.0;       ///< log-odds against the best other way, above those of the prior
  double near_m = 1.6;     ///< where the body is known within this deviation,
  double near_nats = 2.5;  ///< the same of which object is which
  double far_m = 2.5;      ///< where it is known worse, four objects are needed
  /// Objects seen again under their old ids that tie the body to where they were seen before, and
  /// how well they must know its place, as a share of the deviation that the graph says.
  std::uint64_t least_tracked = 2;
  double tracked_gain = 0.7;
  /// An accepted loop closure that the graph rejects over this distance is retracted. One that was
  /// never accepted waits this long for others that agree.
  double withdraw_after_m = 8.0, give_up_after_m = 60.0;
  double floor_m = 0.1, floor_rad = 0.005;  ///< least deviation of a loop
  /// An object is recalled where its place relative to the body is known better than that.
  double hold_back_m = 1.0, hold_back_rad = 0.035;
};

struct DriftScaleParameters {
  double prior_sigma = 1.0;  ///< of the logarithm of the scale, before any loop
  double quantile = 0.8;
};

struct Parameters {
  DriftScaleParameters drift_scale;
  AnchorParameters anchor;
  PlaceParameters place;
  GraphParameters graph;
  LoopParameters loop;
};

}  // namespace perdure::mapping
