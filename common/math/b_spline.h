// Weights of uniform B-splines of any order, plain and cumulative. Source: Sommer et al.,
// "Efficient Derivative Computation for Cumulative B-Splines on Lie Groups", CVPR 2020, eq. 14, 16.
#pragma once

#include <array>
#include <cstddef>

namespace perdure {

namespace detail {

constexpr double binomial(int n, int k) {
  double value = 1.0;
  for (int i = 1; i <= k; ++i) value = value * (n - k + i) / i;
  return value;
}

constexpr double power(double base, int exponent) {
  double value = 1.0;
  for (int i = 0; i < exponent; ++i) value *= base;
  return value;
}

}  // namespace detail

/// Returns the weights of `Order` neighbouring controls as polynomials in s: [control][power of s].
/// Source: Sommer et al. 2020, eq. 14 (Qin's general matrix of uniform B-splines).
template <int Order>
constexpr std::array<std::array<double, Order>, Order> blendingMatrix() {
  std::array<std::array<double, Order>, Order> m{};
  double factorial = 1.0;
  for (int i = 2; i < Order; ++i) factorial *= i;
  for (int control = 0; control < Order; ++control) {
    for (int n = 0; n < Order; ++n) {
      double sum = 0.0;
      for (int l = control; l < Order; ++l) {
        const double sign = (l - control) % 2 == 0 ? 1.0 : -1.0;
        sum += sign * detail::binomial(Order, l - control) *
               detail::power(Order - 1 - l, Order - 1 - n);
      }
      m[static_cast<std::size_t>(control)][static_cast<std::size_t>(n)] =
          detail::binomial(Order - 1, n) / factorial * sum;
    }
  }
  return m;
}

/// Returns the weights of the differences between neighbouring controls (eq. 16): each row is the
/// sum of the rows of blendingMatrix() from this one on.
template <int Order>
constexpr std::array<std::array<double, Order>, Order> cumulativeMatrix() {
  auto m = blendingMatrix<Order>();
  for (std::size_t row = Order - 1; row-- > 0;) {
    for (std::size_t n = 0; n < Order; ++n) m[row][n] += m[row + 1][n];
  }
  return m;
}

/// Returns the value and the first two derivatives of a polynomial at s. T may be a dual number.
template <class T, std::size_t N>
std::array<T, 3> evaluatePolynomial(const std::array<double, N>& coefficients, const T& s) {
  std::array<T, 3> v{T(0.0), T(0.0), T(0.0)};
  for (std::size_t i = N; i-- > 0;) {
    v[2] = v[2] * s + 2.0 * v[1];
    v[1] = v[1] * s + v[0];
    v[0] = v[0] * s + coefficients[i];
  }
  return v;
}

}  // namespace perdure
