// The context file, which says how often classes stand near each other: written by `perdure map
// learn-context`, read by the filter. Derivation: tools/docs/maths/new_classes_and_context.md.
#pragma once

#include <string>

#include "services/semantic_filter/core/belief/class_prior.h"

namespace perdure::semantic_filter {

/// Throws StartupError: kUnavailable if the file cannot be read, kConfiguration with all its errors
/// as file:line:col.
ContextMatrix loadContext(const std::string& path);
ContextMatrix parseContext(const std::string& yaml, const std::string& file);
/// Formats a matrix as parseContext reads it, with three decimals. `note`: comment in the first
/// line.
std::string formatContext(const ContextMatrix& matrix, const std::string& note);

}  // namespace perdure::semantic_filter
