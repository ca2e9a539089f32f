// The parameters of the filter. config.cpp declares those that can be set.
#pragma once

#include <cstdint>

namespace perdure::semantic_filter {

struct BoxParameters {
  double sigma_px = 0.4;          ///< px; least standard deviation of a side
  double sigma_network_px = 0.8;  ///< the same in pixels of the network's input, if known
  double sigma_relative = 0.045;  ///< added, in widths (x sides) or heights (y sides) of the box
  double sigma_weak = 0.05;       ///< added to it times the probability that the box is clutter
  double border_px = 6.0;         ///< the border censors a side that is nearer
  double gate = 0.9997;           ///< probability inside the gate of the innovation
  double tail = 5.0;              ///< degrees of freedom of the innovation's t distribution
  double min_size_px = 14.0;      ///< root of the area at which P_D is halved
  double min_network_px = 10.0;   ///< the same in pixels of the network's input, if known
  double noise_view = 0.001;      ///< view change that renews the noise; rad or log distance
  double amodal = 0.5;            ///< share of boxes that include the occluded part of the object
  double partial_view = 0.05;     ///< share of boxes that show a part of the object only
  std::int64_t iterations = 3;    ///< of the iterated EKF
  double prior_sides = 200.0;     ///< weight of the assumed noise, in sides of boxes
  double prior_azimuths = 10.0;   ///< weight of the assumed noise, in azimuths
  double bias_share = 0.3;        ///< share of a side's variance that is detector bias
  /// View change after which the bias has fallen to 1/e.
  double bias_angle = 0.3;         ///< direction to the object, rad
  double bias_log_distance = 0.3;  ///< logarithm of the distance
  double bias_image_angle = 0.3;   ///< position in the image, rad
};

struct ClutterParameters {
  double per_frame = 2.0;             ///< expected false boxes in one image
  double min_size_px = 8.0;           ///< their sizes are log-uniform from this to the image size
  double censored_probability = 0.1;  ///< probability that a side of a false box is censored
  double max_log_ratio = 8.0;         ///< limit of activations relative to clutter, nats
  double other_lookalike = 0.2;  ///< share of objects of no known class that resemble a known one
  double other_prior = 0.01;     ///< probability of "other" at initiation
};

struct PoseParameters {
  /// Random walk added to the pose error, whatever covariance the odometry reports. Exact poses
  /// have none.
  double walk_position = 0.005;   ///< m/√m
  double walk_rotation = 0.0002;  ///< rad/√m
};

struct TemperingParameters {
  double correlation = 0.5;  ///< of the errors of two observations from the same viewpoint
  /// View change after which the correlation has fallen to 1/e.
  double angle = 0.1;                 ///< direction to the object, rad
  double log_distance = 0.1;          ///< logarithm of the distance
  double image_angle = 0.03;          ///< position in the image, rad
  double detection_rate_prior = 3.0;  ///< weight of the class's P_D, in observations
};

struct VisibilityParameters {
  std::int64_t cell_px = 8;           ///< cell size of the depth buffer
  double minimum = 0.25;              ///< a smaller visible fraction counts as 0: no evidence
  double full = 0.7;                  ///< visible fraction from which an object counts as visible
  double solid = 0.4;                 ///< existence from which an object occludes others
  double unmapped_occluder = 0.7;     ///< probability far from the directions of detections
  double hard_to_detect = 0.05;       ///< probability that detections are rare from a new view
  double hard_detection_share = 0.3;  ///< P_D from such a view, relative to the usual one
  /// View change after which the correlation of the learned values has fallen to 1/e. A hedge hides
  /// an object from a whole side, at any distance; a detector fails from single views.
  double occluder_angle = 1.2;              ///< of the occluder: direction to the object, rad
  double detectability_angle = 0.15;        ///< of the rest: direction to the object, rad
  double detectability_log_distance = 0.3;  ///< of the rest: logarithm of the distance
};

struct MotionParameters {
  double position_walk = 0.02;    ///< of a static object, m/√s
  double yaw_walk = 0.01;         ///< of a static object, rad/√s
  double acceleration = 1.0;      ///< white, of a moving object, m/s²/√Hz
  double survival_s = 3600.0;     ///< mean time for which an object stays where it is
  double mover_survival_s = 1.0;  ///< mean survival time of a moving object without detections
  double min_speed = 0.7;         ///< slower objects count as static, m/s
  double slow_share = 0.25;       ///< share of a class's speed deviation; slower motion is rare
  double creeping = 0.03;         ///< factor on the Gaussian speed prior for such slow motion
  double lost_sigma_m = 10.0;  ///< moving hypotheses with a larger position deviation are removed
  double start_probability = 0.02;  ///< of the moving hypothesis that is added to a static one
  double misplaced_odds = 5.0;      ///< of a wrong depth against a start of motion
  double misplaced_sigma = 0.1;     ///< relative deviation of such a depth and size
  double start_nis = 3.0;           ///< normalised innovation above which both hypotheses are added
};

struct GroundParameters {
  bool use = true;
  double slope = 0.03;         ///< standard deviation
  double roughness = 0.04;     ///< random walk of the height, m/√m
  double prior_objects = 5.0;  ///< weight of slope and roughness, in objects
  double sigma_m = 0.05;       ///< deviation of an underside from the ground: kerbs, wheels
  double reach_m = 60.0;       ///< range within which objects contribute
  double resolved = 0.06;      ///< largest relative position deviation of an object that counts
  double span_m = 3.0;         ///< range of the undersides of objects that do not stand on it
  double body_height_m = 0.0;  ///< of the body's origin above the ground; 0: not known
  double body_height_sigma_m = 0.05;
};

struct InitiationParameters {
  double odds = 0.2;             ///< expected new objects against false boxes, in one box
  double min_log_ratio = 0.5;    ///< weaker boxes only support tracks, nats
  double explained = 0.5;        ///< probability; a better explained box starts no track
  std::int64_t max_classes = 4;  ///< of the network's list at initiation; "other" is added
  double class_ratio = 0.01;     ///< classes below this share of the best are dropped
  double landmark_decay = 0.3;   ///< e-folding distance of a landmark's weight, in half boxes
  std::int64_t min_landmarks = 6;
  double min_distance_m = 1.5;
};

struct TrackParameters {
  double confirm = 0.95;          ///< existence that confirms a track
  std::int64_t confirm_hits = 3;  ///< detections that a confirmation requires
  double confirm_sigma_m = 2.0;   ///< largest deviation relative to the body; lost at 1.5 times it
  double certain = 0.99;          ///< upper limit of existence, so that misses count
  double certain_again = 0.999;   ///< the same after a detection on another visit
  double delete_below = 0.02;     ///< existence below which a track is deleted
  double delete_tentative_below = 0.05;  ///< the same for a track with one detection
  double tentative_s = 10.0;             ///< invisible time after which a tentative track ends
  double class_dominates = 0.995;        ///< a class above this probability removes the others
  double size_gate = 4.5;                ///< deviations of the class's size
  double hypothesis_floor = 0.002;       ///< lighter hypotheses are pruned
  double scale_resolved = 0.06;   ///< relative deviation of the distance; above it "other" stays
  double hypothesis_merge = 1.0;  ///< squared Mahalanobis distance
  double reidentify_s = 60.0;     ///< a deleted track may be re-identified for this time
  double merge_overlap = 0.25;    ///< least shared over joint volume of two tracks of one object
  double merge_turns = 0.1;       ///< the same for two that are detected in turns
  double merge_inside = 0.3;      ///< least share of an "other" inside a known object to merge it
  std::int64_t max_objects = 2000;
};

inline constexpr int kMostKeyframes = 32;  ///< limit of smoothing.keyframes

struct SmoothingParameters {
  std::int64_t keyframes = 24;  ///< most keyframes of one track; 0: no batch estimate
  std::int64_t least = 5;       ///< with fewer keyframes the state of the EKF stays
  double fresh = 0.3;           ///< share of new keyframes that requires another fit
  std::int64_t per_frame = 2;   ///< tracks that are fitted in one frame
  std::int64_t patience = 3;    ///< largest factor by which fits with little effect become rarer
  double new_view = 0.12;       ///< least view change between keyframes, in bias lengths
  double place = 0.2;           ///< largest position deviation of a fit, relative to the distance
  double contradicted = 0.2;    ///< share of keyframes that may contradict a fit
  double least_weight = 0.02;   ///< of a hypothesis that is fitted
};

struct MemoryParameters {
  bool archive = true;
  double recall_m = 60.0;  ///< objects of the map that are nearer to the body are recalled
  double margin_m = 20.0;  ///< tracks that are farther than both together are archived
  double after_s = 5.0;    ///< if they were not detected for this time
};

struct Parameters {
  BoxParameters box;
  ClutterParameters clutter;
  InitiationParameters initiation;
  MotionParameters motion;
  PoseParameters pose;
  TemperingParameters tempering;
  VisibilityParameters visibility;
  TrackParameters tracks;
  SmoothingParameters smoothing;
  GroundParameters ground;
  MemoryParameters memory;
};

/// Gates: squared Mahalanobis distances. In brackets: dimensions, and the probability that a
/// Gaussian residual is beyond. The gate of a box is box.gate, that of two hypotheses
/// tracks.hypothesis_merge.
namespace gates {

// The box of a keyframe and a hypothesis.
inline constexpr double kWholeView = 9.0;       ///< [4, .06] beyond, a partial view is tried
inline constexpr double kForeignBox = 14.0;     ///< [4, .007] beyond, it is of another object
inline constexpr double kContradiction = 25.0;  ///< [4, 5e-5] beyond, it contradicts a MAP fit

// Two boxes of one image.
inline constexpr double kSameEdge = 4.0;  ///< [1, .05] beyond, two sides are not the same edge
inline constexpr double kLower = 4.0;     ///< [1, .05] beyond, one box reaches lower

// Two Gaussians.
inline constexpr double kNoFusion = 24.3;  ///< [7, .001] beyond, the mean of both would be wrong
inline constexpr double kSameMode = 1.0;   ///< [7, .995] below, two modes of a track are one
inline constexpr double kSameFit = 0.25;   ///< [7] below, a fit has reached a known mode
inline constexpr double kUnchanged = 1.0;  ///< [7, .995] below, a refit changed little

// Heights of an object and of the ground.
inline constexpr double kGroundOutlier = 12.0;  ///< [1, .0005] beyond, it does not stand on it

}  // namespace gates

}  // namespace perdure::semantic_filter
