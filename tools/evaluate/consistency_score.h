// Whether covariances are consistent: mean normalised estimation error squared (ANEES) of the map's
// objects in its χ² band (Bar-Shalom et al., 5.4).
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

/// Normalised squared errors with `dof` degrees of freedom each; χ² if they are consistent.
struct Anees {
  std::string what;
  int dof = 1;
  std::vector<double> nees;

  double mean() const;                     ///< per degree of freedom: 1 if consistent; 0 if empty
  double median() const;                   ///< median of nees, not per degree of freedom
  double within3Sigma() const;             ///< share within 3 standard deviations
  std::pair<double, double> band() const;  ///< 95 % band of mean(), independent objects
};

/// ANEES over runs of different seeds. A run is one sample: its pose errors are common.
struct RunAnees {
  std::string what;
  int dof = 1;
  std::vector<double> means;  ///< mean of each run, per degree of freedom

  void add(const Anees& run);  ///< ignores a run without objects
  double mean() const;
  double standardError() const;            ///< standard error of the mean, from the runs
  std::pair<double, double> band() const;  ///< 95 % band of mean(), one object in each run
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

/// Transform from the ground truth's world to the run's, by position and by the rotation about z
/// that best aligns the two attitudes. It also works for a body whose x axis points up.
RigidTransform placedOn(const RigidTransform& T_WB, const RigidTransform& true_T_WB);

/// Scores over the rows of a run. The rows are correlated, so that no band applies to their mean.
struct OdometryScore {
  Anees orientation{"orientation of the body", 3, {}}, position{"position of the body", 3, {}},
      velocity{"velocity of the body", 3, {}};
};
/// The ground truth's W is aligned with the run's once, at the first common row of each epoch. Rows
/// without a true pose within ±10 ms are omitted.
OdometryScore scoreOdometry(const std::vector<OdometryRow>& rows, const replay::PoseFile& truth);

struct ConsistencyScore {
  Anees position{"position", 3, {}}, yaw{"yaw", 1, {}},
      half_yaw{"yaw but for its half turns", 1, {}}, size{"size", 3, {}};
  std::uint64_t objects = 0, left_out = 0;  ///< left_out: without a partner, or moving
};

/// Compares each static object with existence above one half and a class name. Its partner is the
/// nearest true object of that class within `within` metres that is not nearer to another belief.
/// T_WT transforms the ground truth's world to the map's.
ConsistencyScore scoreConsistency(const std::vector<MapBelief>& beliefs, const sim::Truth& truth,
                                  const RigidTransform& T_WT, double within);

}  // namespace perdure::tools
