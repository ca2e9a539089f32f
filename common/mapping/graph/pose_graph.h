// The pose graph of the anchors. Each anchor has position and yaw (Carlone 2014). Loops that may be
// wrong have a robust cost (Agarwal 2013, dynamic covariance scaling). Derivation:
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
/// limit is a χ² of 24, which one in ten thousand correct edges exceeds.
inline constexpr double kBelieved = 0.5;

/// Measured T_ab with its covariance. The covariance may be singular, because the optimiser adds
/// standard deviations of 1 mm and 1e-5 rad.
struct Edge {
  AnchorId a = 0, b = 0;
  LevelGaussian T_ab;
  EdgeKind kind = EdgeKind::kLoop;
};

struct OptimiseReport {
  bool converged = false;
  int iterations = 0;
  double cost = 0.0;  ///< sum of the costs: χ² of odometry edges, robust cost of other edges
  /// Factors of the information of loop and tracking edges, (0, 1].
  std::map<EdgeId, double> weights;
  std::map<EdgeId, double> chi2;  ///< unweighted χ² of these edges
  double largest_move_m = 0.0;    ///< maximum over all anchors
};

class PoseGraph {
 public:
  explicit PoseGraph(const GraphParameters& parameters) : parameters_(parameters) {}

  /// Adds the first anchor of a session at `T_MA`. It begins a new component, and is fixed. A
  /// component is a set of anchors that accepted edges connect.
  void addFirst(AnchorId id, const LevelPose& T_MA);
  /// Adds an anchor with its odometry edge, at the pose in M that follows from its increment.
  /// `previous` must be in the graph.
  void add(AnchorId id, AnchorId previous, const LevelGaussian& from_previous);
  /// Adds an edge between two anchors of the graph. Poses change only in optimise().
  EdgeId add(const Edge& edge);
  /// Adds a stored edge with its stored id and weight. Later edges get higher ids.
  void restore(EdgeId id, const Edge& edge, double weight);
  void remove(EdgeId id);
  /// Multiplies the covariance of each odometry edge by the factor of its second anchor, if
  /// `factors` has one.
  void scaleOdometry(const std::map<AnchorId, DriftVariance>& factors);
  /// Fixes the first anchor of each component, and no others. optimise() calls this function.
  void holdFirstAnchors();

  /// Minimises the cost from the present poses. If the kernel rejects a new edge in the result,
  /// also tries wider kernels, because after much drift a correct loop resembles a wrong one.
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
  /// The number of fixed anchors, which is the number of components after optimise().
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
