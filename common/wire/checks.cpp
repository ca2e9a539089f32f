#include "common/wire/checks.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "common/base/algorithms/utf8.h"

namespace perdure::wire {
namespace {

constexpr double kSymmetry = 1e-6;

bool isSymmetric(const Eigen::Ref<const Eigen::MatrixXd>& P) {
  const double largest = P.cwiseAbs().maxCoeff();
  return (P - P.transpose()).cwiseAbs().maxCoeff() <= kSymmetry * largest;
}

/// Returns the correlation matrix of P; zero rows of P become rows of the identity. Returns an
/// empty matrix if a variance is negative, or is zero in a row that is not.
Eigen::MatrixXd correlations(const Eigen::Ref<const Eigen::MatrixXd>& P) {
  Eigen::VectorXd scale(P.rows());
  for (Eigen::Index i = 0; i < P.rows(); ++i) {
    const bool zero_row = P.row(i).isZero(0.0);
    if (!(P(i, i) > 0) && !zero_row) return {};
    scale[i] = zero_row ? 0.0 : 1.0 / std::sqrt(P(i, i));
  }
  Eigen::MatrixXd C = scale.asDiagonal() * P * scale.asDiagonal();
  C.diagonal().setOnes();
  return C;
}

bool hasCholesky(const Eigen::MatrixXd& C) {
  return C.size() > 0 && C.allFinite() && Eigen::LLT<Eigen::MatrixXd>(C).info() == Eigen::Success;
}

}  // namespace

bool inside(double value, const Limits& limits) {
  return value >= limits.low && value <= limits.high;  // false for NaN
}

bool isSizeOf(const Frame& frame, std::size_t bytes) {
  constexpr std::size_t kFewest = 4, kHeaders = 4096;  // bytes of start and end marks; bytes of
                                                       // tables and comments
  const std::size_t pixels = std::size_t{frame.width} * frame.height * channelsOf(frame.encoding);
  if (!isCompressed(frame.encoding)) return bytes == pixels;
  return bytes >= kFewest && bytes <= 2 * pixels + kHeaders;
}

bool isText(std::string_view text) {
  while (!text.empty()) {
    const std::size_t length = lengthOfCharacter(text);
    if (length == 0 || text.front() == '\0') return false;
    text.remove_prefix(length);
  }
  return true;
}

bool isSemiDefinite(const Eigen::Ref<const Eigen::MatrixXd>& P) {
  constexpr double kRounding = 1e-6;  // tolerated rounding errors of correlations
  if (P.rows() != P.cols() || !P.allFinite() || !isSymmetric(P)) return false;
  Eigen::MatrixXd C = correlations(P);
  if (C.size() == 0) return false;
  C.diagonal().array() += kRounding;
  return hasCholesky(C);
}

bool isDefinite(const Eigen::Ref<const Eigen::MatrixXd>& P) {
  if (P.rows() != P.cols() || !P.allFinite() || !isSymmetric(P)) return false;
  return (P.diagonal().array() > 0).all() && hasCholesky(correlations(P));
}

}  // namespace perdure::wire
