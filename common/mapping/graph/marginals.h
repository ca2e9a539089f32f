// Uncertainty of anchors relative to each other: marginal covariances of the optimised graph, from
// one sparse factorisation of its normal equations.
#pragma once

#include <Eigen/SparseCholesky>
#include <map>
#include <optional>
#include <vector>

#include "common/mapping/graph/pose_graph.h"

namespace perdure::mapping {

class Marginals {
 public:
  /// Marginals of the present graph. `from`: the anchor to which all results are relative. Edges
  /// count with their weights of the last optimise(). The graph must outlive this object.
  Marginals(const PoseGraph& graph, AnchorId from);

  /// The first anchor of the component of `from`.
  AnchorId first() const { return components_.at(from_); }
  /// T_from,anchor with its covariance. Returns nothing if no path leads to the anchor, or if the
  /// normal equations cannot be solved.
  std::optional<LevelGaussian> to(AnchorId anchor) const;
  /// Variances of [p, yaw] in M of every anchor, relative to the first anchor of its component; m²
  /// and rad². Anchors whose variances cannot be computed are omitted. The cost is about that of
  /// one factorisation. The recursion of Takahashi (Erisman and Tinney 1975) computes the inverse
  /// only at the nonzero elements of the factor.
  std::map<AnchorId, Eigen::Vector4d> variances() const;

 private:
  using Factor = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>;

  Eigen::VectorXd diagonalOfInverse() const;
  /// Columns of an anchor in the inverse; zero for a fixed anchor.
  Eigen::MatrixXd columnsOf(AnchorId anchor) const;
  Eigen::Matrix4d blockOf(const Eigen::MatrixXd& columns, AnchorId anchor) const;

  const PoseGraph* graph_;
  AnchorId from_;
  std::map<AnchorId, Eigen::Index> rows_;    ///< rows of anchors that are not fixed
  std::map<AnchorId, AnchorId> components_;  ///< the first anchor of each anchor's component
  Factor factor_;
  bool usable_ = false;
  Eigen::MatrixXd from_columns_;
  mutable std::map<AnchorId, std::optional<LevelGaussian>> asked_;
};

}  // namespace perdure::mapping
