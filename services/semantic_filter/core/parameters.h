// The constants of the estimator, with their defaults; config.cpp describes each for people.
#pragma once

#include <cstdint>

namespace perdure::semantic_filter {

struct BoxParameters {
  double sigma_px = 0.4;          ///< floor of a side's standard deviation
  double sigma_network_px = 0.8;  ///< the same in pixels of the network's input, where known
  double sigma_relative = 0.045;  ///< of the box's width (x sides) or height (y sides)
  double sigma_doubt = 0.05;      ///< added to it in proportion to the probability of clutter
  double border_px = 6.0;         ///< a side this near to the image border is cut by it
  double gate = 0.9997;           ///< probability mass inside the gate of the innovation
  double tail = 5.0;              ///< degrees of freedom of the innovation's t distribution
  double min_size_px = 14.0;      ///< √ of the area where detection is half as likely
  double min_network_px = 10.0;   ///< the same in the pixels of the network's input, where known
  double noise_view = 0.001;      ///< change of view, rad or of log distance, that renews the noise
  double amodal = 0.5;            ///< share of boxes that span what something hides of the thing
  double part = 0.05;             ///< share of boxes that show a part of a thing alone
  std::int64_t iterations = 3;    ///< of the iterated EKF
  double assumed_sides =
      200.0;  ///< seen ones that updateClassAndExistence as much as these assumptions
  double assumed_azimuths = 10.0;  ///< the same of what the classes and the network say of these
  /// The error of a side is noise and, for this share of its variance, the track's b, which stays
  /// while the view stays; b falls to 1/e after a change of
  double bias_share = 0.3;
  double bias_angle = 0.3;         ///< aspect, rad
  double bias_log_distance = 0.3;  ///< logarithm of the distance
  double bias_image_angle = 0.3;   ///< place in the image, rad
};

struct ClutterParameters {
  double per_frame = 2.0;    ///< expected false boxes in one image
  double min_size_px = 8.0;  ///< of false boxes: sizes are log-uniform from here to the image
  double censored_probability = 0.1;  ///< that a false box is cut at a given side
  double max_log_ratio = 8.0;         ///< activations are clamped to this many nats against clutter
  double other_lookalike = 0.2;  ///< share of things of no known class that look like a known one
  double other_prior = 0.01;     ///< PMF of "other" at birth
};

struct InitiationParameters {
  double odds = 0.2;             ///< expected new tracks in a box against false alarms
  double min_log_ratio = 0.5;    ///< weaker boxes only support tracks that are there
  double explained = 0.5;        ///< a box claimed with more than this gives no birth
  std::int64_t max_classes = 4;  ///< kept of the network's list, "other" beside them
  double class_ratio = 0.01;     ///< classes below this share of the best are not kept
  double landmark_decay = 0.3;   ///< e-folding distance of a landmark's weight, in half boxes
  std::int64_t min_landmarks = 6;
  double min_distance_m = 1.5;
};

struct MotionParameters {
  double position_walk = 0.02;      ///< m/√s, of static hypotheses
  double yaw_walk = 0.01;           ///< rad/√s
  double acceleration = 1.0;        ///< m/s²/√Hz, of moving hypotheses
  double survival_s = 3600.0;       ///< mean time a thing stays where it is
  double mover_survival_s = 1.0;    ///< mean time an unseen mover goes on as it did
  double min_speed = 0.7;           ///< m/s: slower ones count as static
  double slow_share = 0.25;         ///< of a class's deviation of speed: slower is creeping
  double creeping = 0.03;           ///< how likely that is against the Gaussian
  double lost_sigma_m = 10.0;       ///< a moving hypothesis less well placed than this is given up
  double start_probability = 0.02;  ///< of a moving hypothesis that is added to a static track
  double misplaced_odds = 5.0;      ///< of having misplaced a thing against its having driven off
  double misplaced_sigma = 0.1;     ///< relative, of distance and size
  double start_nis = 3.0;           ///< running innovation above which it is added
};

struct PoseParameters {
  double walk_position = 0.005;   ///< m/√m, where odometry has no covariance
  double walk_rotation = 0.0002;  ///< rad/√m
  /// Of odometry that says its own uncertainty, in place of that; 0: what it says is believed.
  double drift_position = 0.015;   ///< m/√m
  double drift_rotation = 0.0003;  ///< rad/√m
};

struct TemperingParameters {
  double correlation = 0.5;   ///< of the errors of two looks from the same place
  double angle = 0.1;         ///< rad, change of aspect after which it has fallen to 1/e
  double log_distance = 0.1;  ///< the same for the logarithm of the distance
  double image_angle = 0.03;  ///< rad, the same for the place in the image
  double found_prior = 3.0;   ///< looks; P_D beside how often an track was found from about here
};

struct VisibilityParameters {
  std::int64_t cell_px = 8;
  double minimum = 0.25;  ///< v below this is 0: no evidence
  double full = 0.7;      ///< v from here on is called visible
  /// That something not on the map hides an track from a view in which it was not yet seen; what
  /// is known of that falls to 1/e after a change of
  double unmapped_occluder = 0.2;
  double hard_to_detect = 0.05;             ///< that nothing does, and the network seldom finds it:
  double hard_detection_share = 0.3;        ///< this share of P_D
  double detectability_angle = 0.15;        ///< aspect, rad
  double detectability_log_distance = 0.3;  ///< logarithm of the distance
  double solid = 0.4;  ///< existence (times its late hit rate) from which an track can hide others
};

struct TrackParameters {
  double confirm = 0.95;
  std::int64_t confirm_hits = 3;
  double confirm_sigma_m =
      1.5;                ///< of its place beside the body; one that is not known is no claim
  double certain = 0.99;  ///< existence is kept below it, so that misses can still be heard
  double certain_again = 0.999;  ///< the same of what was found on another visit
  double gone = 0.02;            ///< existence below which an track is forgotten
  double gone_tentative = 0.05;
  double tentative_s =
      10.0;  ///< out of visibility, after which what confirm_hits did not confirm is too
  double class_dominates = 0.995;
  double size_gate = 4.5;  ///< deviations of the class's size beyond which nothing is of the class
  double hypothesis_floor = 0.002;
  double scale_resolved = 0.06;   ///< relative deviation of the distance; before it "other" stays
  double hypothesis_merge = 1.0;  ///< squared Mahalanobis distance
  double return_s = 60.0;         ///< what is found again in its place within it is the same thing
  double merge_overlap = 0.25;
  double merge_turns = 0.1;   ///< the same of two that take turns in being found
  double merge_inside = 0.3;  ///< share of a thing of no known class that lies in a known one
  std::int64_t max_objects = 2000;
};

/// Of the estimate from all remembered looks at once; `keyframes` 0 switches it off.
struct SmoothingParameters {
  std::int64_t keyframes = 24;  ///< remembered at most, of one track
  std::int64_t least = 5;       ///< with fewer the filter's own state stays
  double fresh = 0.3;           ///< share of the looks that is new when it is map_fit again
  std::int64_t per_frame = 2;   ///< tracks that are map_fit in one frame, those in most need
  std::int64_t patience = 3;    ///< times as many new looks that are waited for, at most
  double new_view = 0.12;       ///< change of view, in lengths of b's correlation, that is new
  double place = 0.2;           ///< relative to the distance: a place less well known is not taken
  double contradicted = 0.2;    ///< share of looks that may contradict the rest
  double least_weight = 0.02;   ///< of a hypothesis that is worth it
};

/// Of the ground that things stand on (core/ground.h).
struct GroundParameters {
  bool use = true;
  double slope = 0.03;      ///< standard deviation
  double roughness = 0.04;  ///< m/√m
  double assumed = 5.0;     ///< things that updateClassAndExistence as much as these assumptions
  double sigma_m = 0.05;    ///< of an underside beside the ground: kerbs, wheels
  double reach_m = 60.0;    ///< things further away say nothing of it
  double resolved = 0.06;   ///< relative deviation of the place of what tells, at most
  double span_m = 3.0;      ///< undersides of what does not stand on it are this far apart
  /// Of the body's origin above the ground that what carries it stands on; 0: not known.
  double body_height_m = 0.0;
  double body_height_sigma_m = 0.05;
};

/// Of what leaves the working set for the map and comes back (DESIGN 5, item 13).
struct MemoryParameters {
  bool archive = true;
  double recall_m = 60.0;  ///< from the body: what the map holds nearer than this comes back
  double margin_m = 20.0;  ///< and leaves when it is farther than both together
  double after_s = 5.0;    ///< and was not seen for so long
};

/// Of where the map of another frame of reference lies (core/map_alignment.h).
struct AlignmentParameters {
  double nats = 25.0;         ///< against chance, at least
  double margin_nats = 10.0;  ///< above the best other way
  std::int64_t pairs = 4;     ///< things that are surely in both, at least
  double known_share = 0.7;   ///< of what is seen is on the map
};

/// Of an error of the pose that the map shows, and that is taken out (core/drift_watch.h).
struct DriftParameters {
  double position = 0.1;    ///< m, least that is worth it
  double rotation = 0.004;  ///< rad
  std::int64_t things = 5;  ///< of earlier visits that were looked at, at least
  double within_m = 25.0;   ///< a thing is looked at once it is so near
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
  AlignmentParameters alignment;
  DriftParameters drift;
};

}  // namespace perdure::semantic_filter
