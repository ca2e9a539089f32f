#include "services/semantic_filter/core/association.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"

namespace perdure::semantic_filter {
namespace {

constexpr int kMaxIterations = 200;
constexpr double kTolerance = 1e-9;

/// psi / (1 + sum over the row's other boxes): what object j offers each box.
Eigen::MatrixXd offers(const Eigen::MatrixXd& psi, const Eigen::MatrixXd& eta) {
  const Eigen::MatrixXd weighted = psi.cwiseProduct(eta);
  const Eigen::VectorXd total = weighted.rowwise().sum();
  Eigen::MatrixXd mu(psi.rows(), psi.cols());
  for (Eigen::Index j = 0; j < psi.rows(); ++j) {
    for (Eigen::Index z = 0; z < psi.cols(); ++z) {
      const double others = std::max(total[j] - weighted(j, z), 0.0);
      mu(j, z) = psi(j, z) / (1.0 + others);
    }
  }
  return mu;
}

}  // namespace

Association associate(const Eigen::MatrixXd& psi, const Eigen::VectorXd& fresh) {
  check(psi.cols() == fresh.size(), "one weight of freshness for each box");
  Association result;
  result.eta = Eigen::MatrixXd::Ones(psi.rows(), psi.cols());
  for (Eigen::Index z = 0; z < psi.cols(); ++z) result.eta.col(z) /= fresh[z];
  Eigen::MatrixXd mu = offers(psi, result.eta);
  for (; result.iterations < kMaxIterations; ++result.iterations) {
    const Eigen::VectorXd column = mu.colwise().sum();
    double change = 0.0;
    for (Eigen::Index j = 0; j < psi.rows(); ++j) {
      for (Eigen::Index z = 0; z < psi.cols(); ++z) {
        const double next = 1.0 / (fresh[z] + std::max(column[z] - mu(j, z), 0.0));
        change = std::max(change, std::abs(next - result.eta(j, z)));
        result.eta(j, z) = next;
      }
    }
    mu = offers(psi, result.eta);
    if (change < kTolerance) break;
  }
  const Eigen::VectorXd column = mu.colwise().sum();
  result.claimed = (column.array() / (fresh.array() + column.array())).matrix();
  return result;
}

}  // namespace perdure::semantic_filter
