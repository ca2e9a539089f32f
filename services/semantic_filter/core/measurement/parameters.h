// Parameters of boxes, clutter and the pose error.
#pragma once

#include <cstdint>

namespace perdure::semantic_filter {

struct BoxParameters {
  double sigma_px = 0.4;          ///< least standard deviation of a side
  double sigma_network_px = 0.8;  ///< the same in pixels of the network's input, where known
  double sigma_relative = 0.045;  ///< added, in widths (x sides) or heights (y sides) of the box
  double sigma_weak = 0.05;       ///< added to it times the probability that the box is clutter
  double border_px = 6.0;         ///< the border censors a side that is nearer
  double gate = 0.9997;           ///< probability inside the gate of the innovation
  double tail = 5.0;              ///< degrees of freedom of the innovation's t distribution
  double min_size_px = 14.0;      ///< root of the area at which P_D is halved
  double min_network_px = 10.0;   ///< the same in pixels of the network's input, where known
  double noise_view = 0.001;      ///< view change that renews the noise; rad or log distance
  double amodal = 0.5;            ///< share of boxes that span what an occluder hides of the object
  double partial_view = 0.05;     ///< share of boxes that show a part of the object only
  std::int64_t iterations = 3;    ///< of the iterated EKF
  double prior_sides = 200.0;     ///< weight of the assumed noise, in sides of boxes
  double prior_azimuths = 10.0;   ///< weight of the assumed noise, in azimuths
  double bias_share = 0.3;        ///< share of a side's variance that is detector bias
  /// View change after which the bias has fallen to 1/e.
  double bias_angle = 0.3;         ///< direction to the object, rad
  double bias_log_distance = 0.3;  ///< logarithm of the distance
  double bias_image_angle = 0.3;   ///< place in the image, rad
};

struct ClutterParameters {
  double per_frame = 2.0;             ///< expected false boxes in one image
  double min_size_px = 8.0;           ///< their sizes are log-uniform from here to the image
  double censored_probability = 0.1;  ///< that a given side of a false box is censored
  double max_log_ratio = 8.0;         ///< activations are clamped to it against clutter, nats
  double other_lookalike = 0.2;  ///< share of objects of no known class that resemble a known one
  double other_prior = 0.01;     ///< probability of "other" at initiation
};

struct PoseParameters {
  /// Walk of the pose error, whatever the odometry says of it. Exact poses have none.
  double walk_position = 0.005;   ///< m/√m
  double walk_rotation = 0.0002;  ///< rad/√m
};

}  // namespace perdure::semantic_filter
