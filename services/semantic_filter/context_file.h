// The file of what stands near what: written by `perdure map learn-context`, read by the filter.
#pragma once

#include <string>

#include "services/semantic_filter/core/belief/class_prior.h"

namespace perdure::semantic_filter {

/// Throws StartupError: kUnavailable where the file cannot be read, kConfiguration with all that is
/// wrong in it as file:line:col.
ContextMatrix loadContext(const std::string& path);
ContextMatrix parseContext(const std::string& yaml, const std::string& file);
/// What parseContext reads, with three decimals. `note` is a comment for its first line.
std::string formatContext(const ContextMatrix& matrix, const std::string& note);

}  // namespace perdure::semantic_filter
