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
  /// Factorises the present graph, which must outlive this object. Results are relative to the
  /// anchor `from`. Edges have their weights from the last optimise(); edges below kBelieved are
  /// left out.
  Marginals(const PoseGraph& graph, AnchorId from);

  /// The first anchor of the component of `from`.
  AnchorId first() const { return components_.at(from_); }
  /// T_from,anchor with its covariance. Returns nothing if no path leads to the anchor, or if the
  /// normal equations cannot be solved.
  std::optional<LevelGaussian> to(AnchorId anchor) const;
  /// Returns the variances of [p, yaw] in M of every anchor, relative to the first anchor of its
  /// component; m² and rad². Omits anchors whose variances cannot be computed. Costs about one
  /// factorisation, because Takahashi's recursion (Erisman and Tinney 1975) computes the inverse
  /// only at the nonzero elements of the factor.
  std::map<AnchorId, Eigen::Vector4d> variances() const;

 private:
  using Factor = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>;

  Eigen::VectorXd diagonalOfInverse() const;
  /// The four columns of an anchor in the inverse; zero for a fixed anchor.
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
