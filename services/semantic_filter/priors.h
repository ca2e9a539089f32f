// Reads the file of class priors, config/class_priors.yaml.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "services/semantic_filter/config.h"
#include "services/semantic_filter/core/belief/classes/class_prior.h"

namespace perdure::semantic_filter {

/// Loads the file that the configuration names. Throws StartupError as loadClassPriors does.
ClassPriors loadPriors(const Config& config);
/// Throws StartupError: kUnavailable if the file cannot be read, kConfiguration with file, line and
/// column of all errors.
ClassPriors loadClassPriors(const std::string& path);
/// Returns, for each class, the points that span its shape, in halves of the cuboid's sides.
std::map<std::string, std::vector<Eigen::Vector3d>> shapePoints(const ClassPriors& priors);
ClassPriors parseClassPriors(const std::string& yaml, const std::string& file);

}  // namespace perdure::semantic_filter
