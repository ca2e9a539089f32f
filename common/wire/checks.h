// Predicates on values from outside. Total: they take anything and never crash.
#pragma once

#include <Eigen/Core>
#include <string_view>

#include "common/types/sensors.h"
#include "common/wire/description/bounds.h"

namespace perdure::wire {

/// Finite and inside.
bool inside(double value, const Limits& limits);
/// Whether a frame's data may have so many bytes: those of its pixels, or of a JPEG of them.
bool isSizeOf(const Frame& frame, std::size_t bytes);
/// UTF-8 without NUL.
bool isText(std::string_view text);
/// Symmetric and positive semi-definite within rounding, whatever the units of its rows.
bool isSemiDefinite(const Eigen::Ref<const Eigen::MatrixXd>& P);
/// Symmetric and positive definite, whatever the units of its rows.
bool isDefinite(const Eigen::Ref<const Eigen::MatrixXd>& P);

}  // namespace perdure::wire
