// Reads config/class_priors.yaml, and the priors of a configuration.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "services/semantic_filter/config.h"
#include "services/semantic_filter/core/belief/class_prior.h"

namespace perdure::semantic_filter {

/// The files that the configuration names: class priors, and context where there is one. Throws
/// StartupError as the two do.
ClassPriors loadPriors(const Config& config);
/// Throws StartupError: kUnavailable where the file cannot be read, kConfiguration with all that is
/// wrong in it as file:line:col.
ClassPriors loadClassPriors(const std::string& path);
/// By class: points that span what its things fill of their cuboids, in halves of the cuboid's
/// sides.
std::map<std::string, std::vector<Eigen::Vector3d>> shapePoints(const ClassPriors& priors);
ClassPriors parseClassPriors(const std::string& yaml, const std::string& file);

}  // namespace perdure::semantic_filter
