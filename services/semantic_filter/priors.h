// Reads config/class_priors.yaml, and all priors that a configuration names.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "services/semantic_filter/config.h"
#include "services/semantic_filter/core/belief/class_prior.h"

namespace perdure::semantic_filter {

/// Loads the files that the configuration names: class priors, and context if there is one. Throws
/// StartupError as the two readers do.
ClassPriors loadPriors(const Config& config);
/// Throws StartupError: kUnavailable if the file cannot be read, kConfiguration with all its errors
/// as file:line:col.
ClassPriors loadClassPriors(const std::string& path);
/// Returns, for each class, the points that span its shape, in halves of the cuboid's sides.
std::map<std::string, std::vector<Eigen::Vector3d>> shapePoints(const ClassPriors& priors);
ClassPriors parseClassPriors(const std::string& yaml, const std::string& file);

}  // namespace perdure::semantic_filter
