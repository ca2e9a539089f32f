// Reads config/class_priors.yaml.
#pragma once

#include <string>

#include "services/semantic_filter/core/priors.h"

namespace perdure::semantic_filter {

/// Throws StartupError: kUnavailable where the file cannot be read, kConfiguration with all that is
/// wrong in it as file:line:col.
ClassPriors loadClassPriors(const std::string& path);
ClassPriors parseClassPriors(const std::string& yaml, const std::string& file);

}  // namespace perdure::semantic_filter
