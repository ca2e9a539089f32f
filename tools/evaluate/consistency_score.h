// Checks whether covariances are consistent: compares the average normalised estimation error
// squared (ANEES) of the map's objects with its χ² band (Bar-Shalom et al., 5.4).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "common/math/rigid_transform.h"
#include "common/replay/files/pose_file.h"
#include "common/types/objects.h"
#include "common/types/odometry.h"
#include "tools/evaluate/simulated_truth.h"

namespace perdure::tools {

/// An object of objects.json, with the Gaussian of its most probable class.
struct MapBelief {
  std::uint64_t id = 0;
  std::string class_name;
  double existence = 0.0, moving = 0.0;
  Vector7d mean = Vector7d::Zero();
  Matrix7d covariance = Matrix7d::Identity();
  TimePoint last_seen;
};
/// Throws StartupError(kUnavailable) if the file is missing or invalid.
std::vector<MapBelief> readBeliefs(const std::filesystem::path& file);

/// Normalised squared errors with `dof` degrees of freedom each. They follow χ² if consistent.
struct Anees {
  std::string what;
  int dof = 1;
  std::vector<double> nees;

  double mean() const;                     ///< per degree of freedom: 1 if consistent; 0 if empty
  double median() const;                   ///< median of nees, not per degree of freedom
  double within3Sigma() const;             ///< share within 3 standard deviations
  std::pair<double, double> band() const;  ///< 95 % band of mean(), independent objects
};

/// ANEES over runs of different seeds. A run is one sample, because its objects share pose errors.
struct RunAnees {
  std::string what;
  int dof = 1;
  std::vector<double> means;  ///< mean of each run, per degree of freedom

  void add(const Anees& run);  ///< ignores a run without objects
  double mean() const;
  double standardError() const;            ///< standard error of the mean, from the runs
  std::pair<double, double> band() const;  ///< 95 % band of mean() if each run had one object
};

struct OdometryRow {
  TimePoint time;
  std::uint64_t epoch = 0;
  RigidTransform T_WB;
  Eigen::Vector3d v_WB = Eigen::Vector3d::Zero();
  Matrix9d covariance = Matrix9d::Zero();  ///< order [θ, p, v]: θ on the right, p and v in W
};
/// Throws StartupError: kUnavailable if the file is missing, kData if a row is invalid.
std::vector<OdometryRow> readOdometry(const std::filesystem::path& file);

/// Transform from the ground truth's world to the run's W. It aligns the positions, and the
/// attitudes as well as a rotation about z can. The body's x axis may point up.
RigidTransform placedOn(const RigidTransform& T_WB, const RigidTransform& true_T_WB);

/// Scores over the rows of a run. No band applies to their mean, because the rows are correlated.
struct OdometryScore {
  Anees orientation{"orientation of the body", 3, {}}, position{"position of the body", 3, {}},
      velocity{"velocity of the body", 3, {}};
};
/// Aligns the ground truth's W with the run's at the first common row of each epoch. Omits rows
/// without a true pose within ±10 ms.
OdometryScore scoreOdometry(const std::vector<OdometryRow>& rows, const replay::PoseFile& truth);

struct ConsistencyScore {
  Anees position{"position", 3, {}}, yaw{"yaw", 1, {}},
      half_yaw{"yaw but for its half turns", 1, {}}, size{"size", 3, {}};
  std::uint64_t objects = 0, left_out = 0;  ///< left_out: moving, or without partner
};

/// Compares each static object that has an existence above one half and a class name with its
/// partner: the nearest true object of that class within `within` metres. A true object is the
/// partner of its nearest belief only. T_WT transforms the ground truth's world to the map's.
ConsistencyScore scoreConsistency(const std::vector<MapBelief>& beliefs, const sim::Truth& truth,
                                  const RigidTransform& T_WT, double within);

}  // namespace perdure::tools
