// Where a map lies in another frame of reference: what is seen now, laid over what is remembered
// (DESIGN 5, item 13: T_MW). Both frames are level, so that yaw and position are sought. Pairs of
// things propose, the likelihood of all that is seen decides, and only what stands out from every
// other way to lay the one over the other is believed.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "services/semantic_filter/core/object.h"
#include "services/semantic_filter/core/parameters.h"

namespace perdure::semantic_filter {

/// A thing at rest.
struct Standing {
  ObjectId id = 0;
  Eigen::Vector3d p = Eigen::Vector3d::Zero();               ///< m, of its centre
  double yaw = 0.0;                                          ///< rad, modulo 180°
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Identity();  ///< of [p, yaw]
  std::vector<ClassNumber> pmf;
};
Standing standingOf(const ObjectBelief& belief);

/// x_W = R_z(yaw) x_M + p: the inverse of T_MW.
struct FrameAlignment {
  double yaw = 0.0;  ///< rad
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  Eigen::Vector3d about_M = Eigen::Vector3d::Zero();  ///< that the covariance refers to
  /// Of [p_W of about_M, yaw].
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  double nats = 0.0;       ///< log-likelihood ratio against things strewn like those of the map
  double next_nats = 0.0;  ///< the same of the best other way
  std::vector<std::pair<ObjectId, ObjectId>> pairs;  ///< remembered and seen, surely one thing

  Eigen::Vector3d operator*(const Eigen::Vector3d& p_M) const;
};

/// Remembered things, laid out to be compared with many views.
class MapAlignment {
 public:
  MapAlignment(std::vector<Standing> remembered, const AlignmentParameters& parameters);

  /// Nothing where too little is seen, it fits nowhere, or in more than one way.
  std::optional<FrameAlignment> align(const std::vector<Standing>& seen) const;

  /// The best way to lay `seen` over the map and the best other one, whether they are believed or
  /// not; for tests and figures.
  std::optional<FrameAlignment> best(const std::vector<Standing>& seen) const;

  std::size_t size() const { return things_.size(); }

 private:
  class Search;
  struct Pair {
    double distance;
    std::size_t a, b;
  };
  std::vector<Standing> things_;
  AlignmentParameters parameters_;
  Eigen::Vector3d middle_ = Eigen::Vector3d::Zero();
  std::vector<ClassNumber> common_;                                         ///< mean PMF
  std::map<std::pair<std::string, std::string>, std::vector<Pair>> pairs_;  ///< by distance
};

/// The alignment after things of known identity were seen in both frames; `start` where there are
/// too few. Each pair is the thing in M and in W.
FrameAlignment refined(const FrameAlignment& start,
                       const std::vector<std::pair<Standing, Standing>>& pairs);

/// A belief of frame B in frame A, both level.
ObjectBelief turned(const RigidTransform& T_AB, ObjectBelief belief);

/// The belief in W. The alignment's error is in its covariance; how it hangs together with the
/// error of the body's pose is not known.
ObjectBelief laidInto(const FrameAlignment& alignment, ObjectBelief belief);

}  // namespace perdure::semantic_filter
