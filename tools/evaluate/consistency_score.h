// Whether the map's covariances are honest: normalised squared errors of its objects against exact
// truth, and their means (ANEES) with the χ² band (Bar-Shalom et al., "Estimation with
// Applications to Tracking and Navigation", 5.4).
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

/// An object of objects.json, by the Gaussian of its most probable class.
struct MapBelief {
  std::uint64_t id = 0;
  std::string class_name;
  double existence = 0.0, moving = 0.0;
  Vector7d mean = Vector7d::Zero();
  Matrix7d covariance = Matrix7d::Identity();
  TimePoint last_seen;
};
/// Throws StartupError(kUnavailable) where the file is missing or is none.
std::vector<MapBelief> readBeliefs(const std::filesystem::path& file);

/// Squared errors over their covariance: of dof degrees each, chi-square where it is honest.
struct Anees {
  std::string what;
  int dof = 1;
  std::vector<double> nees;

  double mean() const;          ///< per degree of freedom: 1 where it is honest; 0 of none
  double median() const;        ///< of nees, not per degree
  double within3Sigma() const;  ///< share
  std::pair<double, double> band() const;  ///< of mean() at 95 %, independent objects
};

/// The same over seeded runs. What one run has in common, its poses' errors, makes its objects err
/// alike: a run counts as one.
struct RunAnees {
  std::string what;
  int dof = 1;
  std::vector<double> means;  ///< of each run, per degree of freedom

  void add(const Anees& run);  ///< nothing of a run without objects
  double mean() const;
  double standardError() const;            ///< of mean(), by the spread of the runs
  std::pair<double, double> band() const;  ///< of mean() at 95 %, one object a run
};

/// A line of odometry.csv.
struct OdometryRow {
  TimePoint time;
  std::uint64_t epoch = 0;
  RigidTransform T_WB;
  Eigen::Vector3d v_WB = Eigen::Vector3d::Zero();
  Matrix9d covariance = Matrix9d::Zero();  ///< of [θ, p, v]: θ on the right, p and v in W
};
/// Throws StartupError: kUnavailable where the file is missing, kData where a line is none.
std::vector<OdometryRow> readOdometry(const std::filesystem::path& file);

/// Takes the truth's world into the run's, by position and by the turn about z that brings the two
/// attitudes nearest to each other: of use for a body whose x axis points up, too.
RigidTransform placedOn(const RigidTransform& T_WB, const RigidTransform& true_T_WB);

/// Over the rows of a run. Those of one run are correlated: no band holds for their mean.
struct OdometryScore {
  Anees orientation{"orientation of the body", 3, {}}, position{"position of the body", 3, {}},
      velocity{"velocity of the body", 3, {}};
};
/// The truth's W is placed on the run's at the first row of each epoch that
/// both know, and never again. Rows without a true pose 10 ms to both sides are left out.
OdometryScore scoreOdometry(const std::vector<OdometryRow>& rows, const replay::PoseFile& truth);

struct ConsistencyScore {
  Anees position{"position", 3, {}}, yaw{"yaw", 1, {}},
      half_yaw{"yaw but for its half turns", 1, {}}, size{"size", 3, {}};
  std::uint64_t objects = 0, left_out = 0;  ///< compared; of no true object or moving
};

/// Each believed, standing object (existence over one half, named) with the true one of its class
/// that is nearest, nearer than `within` metres and not nearer to another belief. T_WT takes the
/// truth's world into the map's.
ConsistencyScore scoreConsistency(const std::vector<MapBelief>& beliefs, const sim::Truth& truth,
                                  const RigidTransform& T_WT, double within);

}  // namespace perdure::tools
