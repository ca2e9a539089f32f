#include "tools/pipeline/settings.h"

#include "common/base/errors.h"
#include "common/base/ids.h"
#include "common/config/fields.h"
#include "tools/base/config_folder.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

struct Service {
  std::string name, file;
  config::Fields fields;
};

std::vector<Service> describeAll(ServiceConfigs& configs) {
  std::vector<Service> services{{"vio", "vio.yaml", {}},
                                {"semantic_filter", "semantic_filter.yaml", {}},
                                {"inference", "inference.yaml", {}},
                                {"map_store", "map_store.yaml", {}},
                                {"detector", "simulated_detector.yaml", {}},
                                {"drifting", "drifting_odometry.yaml", {}}};
  vio::describe(configs.vio, services[0].fields);
  semantic_filter::describe(configs.semantic_filter, services[1].fields);
  inference::describe(configs.inference, services[2].fields);
  map_store::describe(configs.map_store, services[3].fields);
  describe(configs.detector, services[4].fields);
  describe(configs.drifting, services[5].fields);
  return services;
}

/// Returns the service that `text` names before the first `separator`. Throws StartupError(kUsage)
/// if there is no such service.
Service& serviceOf(std::vector<Service>& services, const std::string& text, char separator,
                   const char* option) {
  const std::string name = text.substr(0, text.find(separator));
  std::string known;
  for (auto& service : services) {
    if (service.name == name && name.size() < text.size()) return service;
    known += (known.empty() ? "" : ", ") + service.name;
  }
  throw StartupError(ExitCode::kUsage, std::string(option) + " " + text +
                                           ": does not begin with a service and `" + separator +
                                           "`; services are " + known);
}

void readFiles(std::vector<Service>& services, const PipelineOptions& options,
               std::vector<config::Problem>& problems) {
  std::vector<std::pair<Service*, std::string>> files;
  for (auto& service : services) {
    const fs::path file = configFolder() / service.file;
    if (fs::exists(file)) files.emplace_back(&service, file.string());
  }
  for (const auto& entry : options.configs) {
    Service& service = serviceOf(services, entry, '=', "--config");
    std::erase_if(files, [&](const auto& file) { return file.first == &service; });
    files.emplace_back(&service, entry.substr(service.name.size() + 1));
  }
  for (const auto& [service, file] : files) {
    const auto found = config::readFile(service->fields, file);
    problems.insert(problems.end(), found.begin(), found.end());
  }
}

/// Sets the walk of the map's graph. The filter's own walk stays, because it also represents errors
/// that boxes share (decision 0030).
void declareWalk(const std::string& walk, config::Fields& map_store) {
  const auto comma = walk.find(',');
  if (comma == walk.npos) {
    throw StartupError(ExitCode::kUsage, "--odometry-walk " + walk +
                                             ": write POSITION,YAW in m/√m and rad/√m, for "
                                             "example .03,.0005");
  }
  std::vector<config::Problem> problems;
  for (const auto& [key, value] :
       {std::pair{"position", walk.substr(0, comma)}, std::pair{"yaw", walk.substr(comma + 1)}}) {
    for (auto& problem :
         config::assign(map_store, std::string("graph.walk_") + key + "=" + value)) {
      problem.file = "--odometry-walk";
      problems.push_back(std::move(problem));
    }
  }
  config::refuse(problems);
}

}  // namespace

ServiceConfigs readServiceConfigs(const PipelineOptions& options) {
  ServiceConfigs configs;
  auto services = describeAll(configs);
  std::vector<config::Problem> problems;
  readFiles(services, options, problems);
  for (const auto& assignment : options.assignments) {
    Service& service = serviceOf(services, assignment, '.', "--set");
    const auto found = config::assign(service.fields, assignment.substr(service.name.size() + 1));
    problems.insert(problems.end(), found.begin(), found.end());
  }
  if (options.seed) configs.detector.seed = configs.drifting.seed = *options.seed;
  config::refuse(problems);
  if (!options.odometry_walk.empty()) {
    for (const auto& assignment : options.assignments) {
      if (!assignment.starts_with("map_store.graph.walk_")) continue;
      throw StartupError(ExitCode::kUsage, "--odometry-walk and --set " + assignment +
                                               " both say how the poses walk: give one of them");
    }
    declareWalk(options.odometry_walk,
                serviceOf(services, "map_store.graph", '.', "--odometry-walk").fields);
  }
  auto& priors = configs.semantic_filter.class_priors;
  if (!fs::exists(priors)) priors = (configFolder() / fs::path(priors).filename()).string();
  std::string values;
  for (const auto& service : services) values += config::toYaml(service.fields);
  configs.digest = digest(values);
  return configs;
}

}  // namespace perdure::tools
