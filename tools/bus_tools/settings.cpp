#include "tools/bus_tools/settings.h"

#include <filesystem>

#include "common/bus/topics.h"

namespace perdure::tools {

std::string configurationFolder() {
  for (const char* folder : {"/etc/perdure", "config"}) {
    std::error_code ignored;
    if (std::filesystem::exists(std::filesystem::path(folder) / "capture.yaml", ignored))
      return folder;
  }
  return {};
}

bus::Options servicesOptions() {
  std::vector<config::Problem> problems;
  bus::Options options = bus::commonOptions(configurationFolder(), problems);
  config::refuse(problems);
  return options;
}

bus::Options listenersOptions() {
  bus::Options options = servicesOptions();
  options.shared_memory_mb = 0;  // readers do not need shared memory
  options.identity.clear();      // the configured identity belongs to the services
  return options;
}

std::string knownTopics() {
  std::string names;
  for (const bus::TopicInfo& info : bus::topicTable()) {
    names += (names.empty() ? "" : ", ") + std::string(info.name);
    if (info.name.ends_with('/')) names += "<camera>";
  }
  return names;
}

}  // namespace perdure::tools
