// Predicates on external values. They accept any value and never crash.
#pragma once

#include <Eigen/Core>
#include <string_view>

#include "common/types/description.h"
#include "common/types/sensors.h"

namespace perdure::wire {

/// Returns true if the value is finite and within the limits.
bool inside(double value, const Limits& limits);
/// Returns whether `bytes` is a possible size of the frame's data, which are raw pixels or a JPEG.
bool isSizeOf(const Frame& frame, std::size_t bytes);
/// Returns whether `text` is valid UTF-8 without NUL.
bool isText(std::string_view text);
/// Returns whether P is symmetric and, within rounding errors, positive semi-definite. Rows may
/// have different units.
bool isSemiDefinite(const Eigen::Ref<const Eigen::MatrixXd>& P);
/// Returns whether P is symmetric and positive definite. Rows may have different units.
bool isDefinite(const Eigen::Ref<const Eigen::MatrixXd>& P);

}  // namespace perdure::wire
