// The pose graph over anchors: position and yaw of each (Carlone 2014 for the parametrisation;
// Agarwal 2013, dynamic covariance scaling, for loops that may be wrong).
// Derivation: tools/docs/maths/pose_graph.md.
#pragma once

#include <cstdint>
#include <map>
#include <set>

#include "common/mapping/frames/anchor.h"
#include "common/mapping/parameters.h"

namespace perdure::mapping {

using EdgeId = std::uint64_t;  ///< counts from 1

enum class EdgeKind : std::uint8_t { kOdometry = 0, kLoop = 1, kTracking = 2 };

/// A loop or tracking edge that counts by less is taken for wrong: with the default kernel a χ² of
/// 24, which one in ten thousand true ones has.
inline constexpr double kBelieved = 0.5;

/// T_ab measured, with its covariance. The optimiser adds a millimetre and 1e-5 rad to it, so it
/// may be singular.
struct Edge {
  AnchorId a = 0, b = 0;
  LevelGaussian T_ab;
  EdgeKind kind = EdgeKind::kLoop;
};

struct OptimiseReport {
  bool converged = false;
  int iterations = 0;
  double cost = 0.0;  ///< sum of χ², of loops and tracking edges by the kernel
  /// By which the information of a loop or tracking edge counts, (0, 1].
  std::map<EdgeId, double> weights;
  std::map<EdgeId, double> chi2;  ///< of the same, unweighted
  double largest_move_m = 0.0;    ///< of any anchor
};

class PoseGraph {
 public:
  explicit PoseGraph(const GraphParameters& parameters) : parameters_(parameters) {}

  /// Adds the first anchor of a session at `T_MA`. Of each component (anchors that hang together
  /// by believed edges) the first anchor is held fast; a session begins one of its own.
  void addFirst(AnchorId id, const LevelPose& T_MA);
  /// Adds an anchor where its increment puts it in M, and its odometry edge. `previous` must be in
  /// the graph.
  void add(AnchorId id, AnchorId previous, const LevelGaussian& from_previous);
  /// Adds an edge between two anchors of the graph; nothing moves before optimise().
  EdgeId add(const Edge& edge);
  /// Adds it as it was, with the id that it had. Ids of new edges go on above.
  void restore(EdgeId id, const Edge& edge, double weight);
  void remove(EdgeId id);
  /// Multiplies the covariances of odometry edges that lead to `anchors`.
  void scaleOdometry(double factor, const std::set<AnchorId>& anchors);
  /// Holds the first anchor of each component fast, and no other. optimise() does so by itself.
  void holdFirstAnchors();

  /// Lowest cost from the present poses on. Where the kernel would reject a new edge from there,
  /// also by way of wider kernels: a true loop after much drift looks like a wrong one.
  OptimiseReport optimise();

  bool contains(AnchorId id) const { return poses_.contains(id); }
  const LevelPose& pose(AnchorId id) const { return poses_.at(id); }
  void setPose(AnchorId id, const LevelPose& pose) { poses_.at(id) = pose; }
  const std::map<AnchorId, LevelPose>& poses() const { return poses_; }
  const std::map<EdgeId, Edge>& edges() const { return edges_; }
  /// Of a loop or tracking edge by the last optimise(); 1 for what is newer, and for odometry.
  double weight(EdgeId id) const;
  /// A loop or tracking edge that no optimise() has seen yet.
  bool isNew(EdgeId id) const;
  /// Of an edge between anchors of the graph, where they are now.
  double chi2(const Edge& edge) const;
  /// How many there were when anchors were last held fast: at the last optimise().
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
