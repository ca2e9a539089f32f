// Numeric Jacobians, for tests of analytic Jacobians and for uses that need little accuracy.
#pragma once

#include <Eigen/Core>

namespace perdure {

/// Returns d f(x) / d x at x for f: R^n -> R^m, by central differences with the same step for all
/// inputs.
template <class Function>
Eigen::MatrixXd numericJacobian(const Function& f, const Eigen::VectorXd& x, double step = 1e-6) {
  const Eigen::VectorXd at_x = f(x);
  Eigen::MatrixXd J(at_x.size(), x.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    Eigen::VectorXd plus = x, minus = x;
    plus[i] += step;
    minus[i] -= step;
    J.col(i) = (Eigen::VectorXd(f(plus)) - Eigen::VectorXd(f(minus))) / (2.0 * step);
  }
  return J;
}

}  // namespace perdure
