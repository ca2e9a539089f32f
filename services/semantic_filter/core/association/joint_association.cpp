#include "services/semantic_filter/core/association/joint_association.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/base/scratch.h"

namespace perdure::semantic_filter {
namespace {

constexpr int kMaxIterations = 200;
constexpr double kTolerance = 1e-9;

struct Pair {
  Eigen::Index j, z;
  double psi, eta;
  double mu = 0.0;  ///< message from track j to box z: psi / (1 + sum over its other boxes)
};

ScratchVector<Pair> pairsOf(const Eigen::MatrixXd& psi, const Eigen::VectorXd& fresh) {
  ScratchVector<Pair> pairs;
  for (Eigen::Index z = 0; z < psi.cols(); ++z) {
    for (Eigen::Index j = 0; j < psi.rows(); ++j) {
      if (psi(j, z) > 0.0) pairs.push_back({j, z, psi(j, z), 1.0 / fresh[z]});
    }
  }
  return pairs;
}

void offer(ScratchVector<Pair>& pairs, Eigen::VectorXd& by_object, Eigen::VectorXd& to_box) {
  by_object.setZero();
  to_box.setZero();
  for (const Pair& p : pairs) by_object[p.j] += p.psi * p.eta;
  for (Pair& p : pairs) {
    p.mu = p.psi / (1.0 + std::max(by_object[p.j] - p.psi * p.eta, 0.0));
    to_box[p.z] += p.mu;
  }
}

}  // namespace

Association associate(const Eigen::MatrixXd& psi, const Eigen::VectorXd& fresh) {
  check(psi.cols() == fresh.size(), "one weight of freshness for each box");
  Association result;
  auto pairs = pairsOf(psi, fresh);
  Eigen::VectorXd by_object(psi.rows()), to_box(psi.cols());
  offer(pairs, by_object, to_box);
  for (; result.iterations < kMaxIterations; ++result.iterations) {
    double change = 0.0;
    for (Pair& p : pairs) {
      const double next = 1.0 / (fresh[p.z] + std::max(to_box[p.z] - p.mu, 0.0));
      change = std::max(change, std::abs(next - p.eta));
      p.eta = next;
    }
    offer(pairs, by_object, to_box);
    if (change < kTolerance) break;
  }
  const Eigen::VectorXd free = (fresh + to_box).cwiseInverse();
  result.eta = free.transpose().replicate(psi.rows(), 1);
  for (const Pair& p : pairs) result.eta(p.j, p.z) = p.eta;
  result.explained = to_box.cwiseProduct(free);
  return result;
}

}  // namespace perdure::semantic_filter
