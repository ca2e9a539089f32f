// The pose graph over anchors: position and yaw of each (Carlone 2014 for the parametrisation;
// Agarwal 2013, dynamic covariance scaling, for loops that may be wrong). Derivation:
// tools/docs/maths/pose_graph.md.
#pragma once

#include <cstdint>
#include <map>
#include <set>

#include "common/mapping/frames/anchor.h"
#include "common/mapping/parameters.h"

namespace perdure::mapping {

using EdgeId = std::uint64_t;  ///< counts from 1

enum class EdgeKind : std::uint8_t { kOdometry = 0, kLoop = 1, kTracking = 2 };

/// A loop or tracking edge with a smaller weight is considered wrong. With the default kernel this
/// is a χ² of 24, which one in ten thousand true edges exceeds.
inline constexpr double kBelieved = 0.5;

/// Measured T_ab with its covariance. The covariance may be singular, because the optimiser adds a
/// millimetre and 1e-5 rad.
struct Edge {
  AnchorId a = 0, b = 0;
  LevelGaussian T_ab;
  EdgeKind kind = EdgeKind::kLoop;
};

struct OptimiseReport {
  bool converged = false;
  int iterations = 0;
  double cost = 0.0;  ///< sum of χ²; loops and tracking edges with the robust kernel
  /// Factors of the information of loop and tracking edges, (0, 1].
  std::map<EdgeId, double> weights;
  std::map<EdgeId, double> chi2;  ///< unweighted χ² of these edges
  double largest_move_m = 0.0;    ///< maximum over all anchors
};

class PoseGraph {
 public:
  explicit PoseGraph(const GraphParameters& parameters) : parameters_(parameters) {}

  /// Adds the first anchor of a session at `T_MA`; it begins a new component. A component is a set
  /// of anchors connected by accepted edges. The first anchor of each component is fixed.
  void addFirst(AnchorId id, const LevelPose& T_MA);
  /// Adds an anchor with its odometry edge, at the pose in M that follows from its increment.
  /// `previous` must be in the graph.
  void add(AnchorId id, AnchorId previous, const LevelGaussian& from_previous);
  /// Adds an edge between two anchors of the graph. Poses do not change before optimise().
  EdgeId add(const Edge& edge);
  /// Adds a stored edge with its earlier id. New edges receive higher ids.
  void restore(EdgeId id, const Edge& edge, double weight);
  void remove(EdgeId id);
  /// Multiplies the covariances of odometry edges by the factors of the anchors to which they lead.
  void scaleOdometry(const std::map<AnchorId, DriftVariance>& factors);
  /// Fixes the first anchor of each component, and no other. optimise() calls it.
  void holdFirstAnchors();

  /// Minimises the cost from the present poses. If the kernel would reject a new edge there, also
  /// tries wider kernels, because after much drift a true loop resembles a wrong one.
  OptimiseReport optimise();

  bool contains(AnchorId id) const { return poses_.contains(id); }
  const LevelPose& pose(AnchorId id) const { return poses_.at(id); }
  void setPose(AnchorId id, const LevelPose& pose) { poses_.at(id) = pose; }
  const std::map<AnchorId, LevelPose>& poses() const { return poses_; }
  const std::map<EdgeId, Edge>& edges() const { return edges_; }
  /// Weight of a loop or tracking edge from the last optimise(); 1 for newer edges and for
  /// odometry.
  double weight(EdgeId id) const;
  /// Returns true for a loop or tracking edge added after the last optimise().
  bool isNew(EdgeId id) const;
  /// χ² of an edge between anchors of the graph, at their present poses.
  double chi2(const Edge& edge) const;
  /// Number of components when anchors were last fixed, at the last optimise().
  std::size_t components() const { return held_fast_.size(); }
  bool isHeldFast(AnchorId id) const { return held_fast_.contains(id); }

 private:
  void take(const std::map<AnchorId, Eigen::Vector4d>& states, OptimiseReport& report);

  GraphParameters parameters_;
  std::map<AnchorId, LevelPose> poses_;
  std::set<AnchorId> held_fast_;
  std::map<EdgeId, Edge> edges_;
  std::map<EdgeId, double> weights_;
  EdgeId next_ = 1;
};

}  // namespace perdure::mapping
