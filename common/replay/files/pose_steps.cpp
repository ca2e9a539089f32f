#include "common/replay/files/pose_steps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/math/gaussian.h"

namespace perdure::replay {
namespace {

constexpr std::string_view kStep = "step_";
constexpr double kMost = 1e4;  // largest entry: a standard deviation of 100 m or 100 rad in a step

/// Returns row and column of "step_A_B" in the order [θ, p], the smaller index first.
std::optional<std::pair<int, int>> entryOf(std::string_view name) {
  if (!name.starts_with(kStep)) return std::nullopt;
  constexpr std::string_view kAxes[] = {"rx", "ry", "rz", "x", "y", "z"};
  for (int a = 0; a < 6; ++a) {
    for (int b = 0; b < 6; ++b) {
      if (name == fmt::format("{}{}_{}", kStep, kAxes[a], kAxes[b])) return std::minmax(a, b);
    }
  }
  return std::nullopt;
}

/// Returns whether a name begins with "step_" in any case, also if it is misspelt, as STEP_X_X.
bool namesStep(std::string_view name) {
  return name.size() >= kStep.size() &&
         std::equal(kStep.begin(), kStep.end(), name.begin(), [](char a, char b) {
           return a == std::tolower(static_cast<unsigned char>(b));
         });
}

/// Returns whether a quantity with zero variance has a covariance with another one.
bool correlatesWithoutVariance(const Matrix6d& C) {
  for (int i = 0; i < 6; ++i) {
    if (C(i, i) == 0.0 && !C.row(i).isZero(0.0)) return true;
  }
  return false;
}

}  // namespace

bool PoseSteps::take(const TextLine& line, bool comment, bool after_poses,
                     std::vector<std::string_view>& fields, Complaints& wrong) {
  std::string error;
  if (entries_.empty()) {
    if (std::none_of(fields.begin(), fields.end(), namesStep)) return true;
    error =
        after_poses ? "a header with step_A_B must stand before the first pose" : entriesOf(fields);
    if (error.empty()) return withoutSteps(fields);
    wrong.add(line.number, error);
    wrong.throwIfAny();  // without a valid header, the lines below it cannot be checked
  } else if (comment) {
    return true;
  } else if (fields.size() != entries_.size()) {
    error = fmt::format("{} columns, but the header names {}", fields.size(), entries_.size());
  } else {
    error = addCovariance(fields);
  }
  if (!error.empty()) {
    wrong.add(line.number, error);
    return false;
  }
  return withoutSteps(fields);
}

bool PoseSteps::withoutSteps(std::vector<std::string_view>& fields) const {
  std::size_t i = 0;
  std::erase_if(fields, [&](std::string_view) { return entries_[i++].has_value(); });
  return true;
}

std::string PoseSteps::entriesOf(const std::vector<std::string_view>& names) {
  for (const auto name : names) {
    const Entry entry = entryOf(name);
    if (!entry && namesStep(name)) {
      return fmt::format("{}: write step_A_B, A and B of x y z rx ry rz", name);
    }
    if (entry && std::count(entries_.begin(), entries_.end(), entry) > 0) {
      return fmt::format("{}: this entry of the symmetric covariance is named twice", name);
    }
    entries_.push_back(entry);
  }
  for (int i = 0; i < 6; ++i) {
    if (std::count(entries_.begin(), entries_.end(), Entry({i, i})) > 0) continue;
    return "the step's covariance needs the six variances step_x_x step_y_y step_z_z step_rx_rx "
           "step_ry_ry step_rz_rz";
  }
  return "";
}

std::string PoseSteps::addCovariance(const std::vector<std::string_view>& fields) {
  Matrix6d C = Matrix6d::Zero();
  for (std::size_t i = 0; i < fields.size(); ++i) {
    if (!entries_[i]) continue;
    const auto value = parseNumber(fields[i]);
    if (!value || std::abs(*value) > kMost) {
      return fmt::format(
          "{}: an entry of the step's covariance is not a number up to 1e4, with a "
          "decimal point",
          fields[i]);
    }
    const auto [row, column] = *entries_[i];
    C(row, column) = C(column, row) = *value;
  }
  const Eigen::Matrix<double, 6, 1> sigma =
      C.diagonal().unaryExpr([](double v) { return v > 0.0 ? std::sqrt(v) : 1.0; });
  const Matrix6d correlations = C.cwiseQuotient(sigma * sigma.transpose());
  constexpr double kRounding = 1e-4;  // tolerance for entries with four digits
  const double variance = C.diagonal().minCoeff(), least = eigenvalues(correlations)(0);
  if (variance < 0.0 || least < -kRounding || correlatesWithoutVariance(C)) {
    return fmt::format(
        "the step's covariance is not positive semi-definite (least variance {:g}, "
        "least eigenvalue of the correlations {:.3g}); check the order and the signs "
        "of its entries",
        variance, least);
  }
  if (least < 0.0) {
    C = withLeastEigenvalue(correlations, 0.0).cwiseProduct(sigma * sigma.transpose());
  }
  covariances.push_back(C);
  return "";
}

}  // namespace perdure::replay
