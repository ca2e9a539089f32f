// Predicates on values from outside. Total: they take anything and never crash.
#pragma once

#include <Eigen/Core>
#include <string_view>

#include "common/wire/bounds.h"

namespace perdure::wire {

/// Finite and inside.
bool inside(double value, const Limits& limits);
/// UTF-8 without NUL.
bool isText(std::string_view text);
/// Symmetric and positive semi-definite within rounding, whatever the units of its rows.
bool isSemiDefinite(const Eigen::Ref<const Eigen::MatrixXd>& P);
/// Symmetric and positive definite, whatever the units of its rows.
bool isDefinite(const Eigen::Ref<const Eigen::MatrixXd>& P);

}  // namespace perdure::wire
