// Parameters of motion and of the ground.
#pragma once

#include <cstdint>

namespace perdure::semantic_filter {

struct MotionParameters {
  double position_walk = 0.02;      ///< of a static object, m/√s
  double yaw_walk = 0.01;           ///< of a static object, rad/√s
  double acceleration = 1.0;        ///< white, of a moving object, m/s²/√Hz
  double survival_s = 3600.0;       ///< mean time for which an object stays where it is
  double mover_survival_s = 1.0;    ///< mean time for which an unseen moving object goes on
  double min_speed = 0.7;           ///< slower objects count as static, m/s
  double slow_share = 0.25;         ///< of a class's speed deviation: below it an object creeps
  double creeping = 0.03;           ///< prior of creeping against the Gaussian speed prior
  double lost_sigma_m = 10.0;       ///< a moving hypothesis that is placed worse is dropped
  double start_probability = 0.02;  ///< of the moving hypothesis that is added to a static one
  double misplaced_odds = 5.0;      ///< of a wrong depth against having driven off
  double misplaced_sigma = 0.1;     ///< of that wrong depth and size, relative
  double start_nis = 3.0;           ///< normalised innovation above which both are added
};

struct GroundParameters {
  bool use = true;
  double slope = 0.03;         ///< standard deviation
  double roughness = 0.04;     ///< random walk of the height, m/√m
  double prior_objects = 5.0;  ///< weight of these two, in objects
  double sigma_m = 0.05;       ///< of an underside beside the ground: kerbs, wheels
  double reach_m = 60.0;       ///< objects further away say nothing
  double resolved = 0.06;      ///< largest relative deviation of the place of an object that says
  double span_m = 3.0;         ///< range of the undersides of what does not stand on the ground
  double body_height_m = 0.0;  ///< of the body's origin above the ground; 0: not known
  double body_height_sigma_m = 0.05;
};

}  // namespace perdure::semantic_filter
