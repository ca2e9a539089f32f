// Reads config/class_priors.yaml, and the priors of a configuration.
#pragma once

#include <string>

#include "services/semantic_filter/config.h"
#include "services/semantic_filter/core/priors.h"

namespace perdure::semantic_filter {

/// The files that the configuration names: class priors, and context where there is one. Throws
/// StartupError as the two do.
ClassPriors loadPriors(const Config& config);
/// Throws StartupError: kUnavailable where the file cannot be read, kConfiguration with all that is
/// wrong in it as file:line:col.
ClassPriors loadClassPriors(const std::string& path);
ClassPriors parseClassPriors(const std::string& yaml, const std::string& file);

}  // namespace perdure::semantic_filter
