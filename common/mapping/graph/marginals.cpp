#include "common/mapping/graph/marginals.h"

#include <algorithm>

#include "common/mapping/graph/components.h"
#include "common/mapping/graph/edge_cost.h"
#include "common/math/gaussian.h"

namespace perdure::mapping {
namespace {

using RowMajor4 = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
}  // namespace

Marginals::Marginals(const PoseGraph& graph, AnchorId from)
    : graph_(&graph), from_(from), components_(componentsOf(graph)) {
  for (const auto& [id, pose] : graph.poses()) {
    if (!graph.isHeldFast(id)) {
      const auto row = static_cast<Eigen::Index>(4 * rows_.size());
      rows_[id] = row;
    }
  }
  std::vector<Eigen::Triplet<double>> entries;
  const auto add = [&](Eigen::Index row, Eigen::Index column, const Eigen::Matrix4d& block) {
    for (Eigen::Index i = 0; i < 4; ++i) {
      for (Eigen::Index j = 0; j < 4; ++j) entries.emplace_back(row + i, column + j, block(i, j));
    }
  };
  for (const auto& [id, edge] : graph.edges()) {
    const double weight = graph.weight(id);
    if (weight < kBelieved) continue;
    const Eigen::Vector4d a = stateOf(graph.pose(edge.a)), b = stateOf(graph.pose(edge.b));
    const double* states[] = {a.data(), b.data()};
    Eigen::Vector4d residual;
    RowMajor4 J_a, J_b;
    double* jacobians[] = {J_a.data(), J_b.data()};
    EdgeCost(edge.T_ab).Evaluate(states, residual.data(), jacobians);
    const auto at_a = rows_.find(edge.a), at_b = rows_.find(edge.b);
    if (at_a != rows_.end()) add(at_a->second, at_a->second, weight * J_a.transpose() * J_a);
    if (at_b != rows_.end()) add(at_b->second, at_b->second, weight * J_b.transpose() * J_b);
    if (at_a != rows_.end() && at_b != rows_.end()) {
      add(at_a->second, at_b->second, weight * J_a.transpose() * J_b);
      add(at_b->second, at_a->second, weight * J_b.transpose() * J_a);
    }
  }
  const auto n = static_cast<Eigen::Index>(4 * rows_.size());
  if (n == 0) return;
  Eigen::SparseMatrix<double> H(n, n);
  H.setFromTriplets(entries.begin(), entries.end());
  factor_.compute(H);
  usable_ = factor_.info() == Eigen::Success;
  if (usable_) from_columns_ = columnsOf(from);
}

Eigen::MatrixXd Marginals::columnsOf(AnchorId anchor) const {
  const auto n = static_cast<Eigen::Index>(4 * rows_.size());
  Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(n, 4);
  const auto at = rows_.find(anchor);
  if (at == rows_.end()) return unit;
  unit.middleRows<4>(at->second).setIdentity();
  return factor_.solve(unit);
}

Eigen::Matrix4d Marginals::blockOf(const Eigen::MatrixXd& columns, AnchorId anchor) const {
  const auto at = rows_.find(anchor);
  if (at == rows_.end()) return Eigen::Matrix4d::Zero();
  return columns.middleRows<4>(at->second);
}

std::optional<LevelGaussian> Marginals::to(AnchorId anchor) const {
  const auto known = asked_.find(anchor);
  if (known != asked_.end()) return known->second;
  std::optional<LevelGaussian>& result = asked_[anchor];
  const auto here = components_.find(from_), there = components_.find(anchor);
  if (here == components_.end() || there == components_.end() || here->second != there->second) {
    return result;
  }
  const LevelPose T_Mf = graph_->pose(from_), T_Ma = graph_->pose(anchor);
  result = LevelGaussian{T_Mf.inverse() * T_Ma, Eigen::Matrix4d::Zero()};
  if (anchor == from_) return result;
  if (!usable_) return result = std::nullopt;
  const Eigen::MatrixXd columns = columnsOf(anchor);
  // The error of T_fa has position R_fᵀ (δp_a − δp_f − δyaw_f up × (p_a − p_f)) and yaw δyaw_a −
  // δyaw_f.
  const Eigen::Vector3d arm = T_Ma.p - T_Mf.p;
  Eigen::Matrix4d by_from = -Eigen::Matrix4d::Identity();
  by_from(0, 3) = arm.y();
  by_from(1, 3) = -arm.x();
  const Eigen::Matrix4d S_aa = blockOf(columns, anchor), S_fa = blockOf(columns, from_);
  const Eigen::Matrix4d S_ff = blockOf(from_columns_, from_);
  Eigen::Matrix4d P = S_aa + by_from * S_ff * by_from.transpose() + by_from * S_fa +
                      S_fa.transpose() * by_from.transpose();
  Eigen::Matrix4d G = Eigen::Matrix4d::Identity();
  G.topLeftCorner<3, 3>() = T_Mf.R().transpose();
  result->covariance = G * P * G.transpose();
  makeSymmetric(result->covariance);
  return result;
}

/// With H = L D Lᵀ: Z = H⁻¹ has Z_jj = 1/d_j − Σ_k L_kj Z_kj and, for i > j, Z_ij = −Σ_k L_kj Z_ki,
/// over the k > j with nonzero L_kj. Only elements of Z at nonzero elements of L are needed.
Eigen::VectorXd Marginals::diagonalOfInverse() const {
  const auto& L = factor_.matrixL().nestedExpression();  // L without its unit diagonal
  const int* starts = L.outerIndexPtr();
  const int* rows = L.innerIndexPtr();
  const double* l = L.valuePtr();
  std::vector<double> z(static_cast<std::size_t>(starts[L.cols()]), 0.0);
  Eigen::VectorXd diagonal(L.cols());
  const auto at = [&](int i, int k) {
    if (i == k) return diagonal[i];
    const int column = std::min(i, k);
    const int* end = rows + starts[column + 1];
    const int* found = std::lower_bound(rows + starts[column], end, std::max(i, k));
    return z[static_cast<std::size_t>(found - rows)];
  };
  for (int j = static_cast<int>(L.cols()) - 1; j >= 0; --j) {
    double on_diagonal = 1.0 / factor_.vectorD()[j];
    for (int i = starts[j + 1] - 1; i >= starts[j]; --i) {
      double sum = 0.0;
      for (int k = starts[j]; k < starts[j + 1]; ++k) sum += l[k] * at(rows[k], rows[i]);
      z[static_cast<std::size_t>(i)] = -sum;
    }
    for (int k = starts[j]; k < starts[j + 1]; ++k) {
      on_diagonal -= l[k] * z[static_cast<std::size_t>(k)];
    }
    diagonal[j] = on_diagonal;
  }
  return diagonal;
}

std::map<AnchorId, Eigen::Vector4d> Marginals::variances() const {
  std::map<AnchorId, Eigen::Vector4d> result;
  const Eigen::VectorXd diagonal = usable_ ? diagonalOfInverse() : Eigen::VectorXd();
  for (const auto& [anchor, component] : components_) {
    const auto row = rows_.find(anchor);
    if (row == rows_.end()) {
      result[anchor].setZero();
      continue;
    }
    if (!usable_) continue;
    Eigen::Vector4d& variances = result[anchor];
    for (Eigen::Index i = 0; i < 4; ++i) {
      variances[i] = diagonal[factor_.permutationP().indices()[row->second + i]];
    }
  }
  return result;
}

}  // namespace perdure::mapping
