// How well anchors are known relative to each other: marginal covariances of the optimised graph,
// from one sparse factorisation of its normal equations.
#pragma once

#include <Eigen/SparseCholesky>
#include <map>
#include <optional>
#include <vector>

#include "common/mapping/graph/pose_graph.h"

namespace perdure::mapping {

class Marginals {
 public:
  /// Of the graph as it is now. `from`: the anchor that others are asked relative to. Edges count
  /// by their weights of the last optimise(). The graph must outlive this.
  Marginals(const PoseGraph& graph, AnchorId from);

  /// The first anchor of the component of `from`.
  AnchorId first() const { return components_.at(from_); }
  /// T_from,anchor with its covariance; nothing where no way leads there, or where the normal
  /// equations cannot be solved.
  std::optional<LevelGaussian> to(AnchorId anchor) const;
  /// Variances of [p, yaw] in M of every anchor, relative to the first one of its component; m² and
  /// rad². Without those of which they cannot be computed. All at the price of about one
  /// factorisation, by the recursion of Takahashi (Erisman and Tinney 1975): the inverse is
  /// computed where the factor is not zero, and nowhere else.
  std::map<AnchorId, Eigen::Vector4d> variances() const;

 private:
  using Factor = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>;

  Eigen::VectorXd diagonalOfInverse() const;
  /// Columns of an anchor in the inverse; zero for one that is held fast.
  Eigen::MatrixXd columnsOf(AnchorId anchor) const;
  Eigen::Matrix4d blockOf(const Eigen::MatrixXd& columns, AnchorId anchor) const;

  const PoseGraph* graph_;
  AnchorId from_;
  std::map<AnchorId, Eigen::Index> rows_;    ///< of anchors that are not held fast
  std::map<AnchorId, AnchorId> components_;  ///< each anchor's, by its first anchor
  Factor factor_;
  bool usable_ = false;
  Eigen::MatrixXd from_columns_;
  mutable std::map<AnchorId, std::optional<LevelGaussian>> asked_;
};

}  // namespace perdure::mapping
