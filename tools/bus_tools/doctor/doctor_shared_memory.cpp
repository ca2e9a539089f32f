#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>

#include "common/bus/shared_memory.h"
#include "tools/bus_tools/doctor/doctor.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

/// Returns the largest `size = …` in RouDi's configuration, in bytes; 0 if there is none.
std::int64_t largestChunk(const std::string& roudi_toml) {
  static const std::regex kSize(R"(^\s*size\s*=\s*(\d{1,12}))");
  std::int64_t largest = 0;
  std::ifstream in(roudi_toml);
  std::smatch match;
  for (std::string line; std::getline(in, line);) {
    if (std::regex_search(line, match, kSize))
      largest = std::max(largest, std::int64_t{std::stoll(match[1])});
  }
  return largest;
}

}  // namespace

std::int64_t configuredSharedMemory(const std::string& folder) {
  std::int64_t largest = 0;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().extension() != ".yaml") continue;
    try {
      const YAML::Node value = YAML::LoadFile(entry.path())["bus"]["shared_memory_mb"];
      if (value.IsDefined()) largest = std::max(largest, value.as<std::int64_t>());
    } catch (const YAML::Exception&) {  // the service's --check-config reports the error
    }
  }
  return largest;
}

Findings checkSharedMemory(const bus::Options& options, const std::string& roudi_toml) {
  if (options.shared_memory_mb == 0) return {};
  Findings findings;
  const auto locator = bus::sharedMemoryLocator();
  if (locator) {
    findings.push_back({Verdict::kOk, "RouDi answers: images go through shared memory"});
  } else {
    findings.push_back({Verdict::kFail, "bus.shared_memory_mb is " +
                                            std::to_string(options.shared_memory_mb) + ", but " +
                                            locator.error().detail +
                                            "; installed: `systemctl enable --now iox-roudi`, then "
                                            "`systemctl restart perdure.target`"});
  }
  const std::int64_t chunk = largestChunk(roudi_toml);
  if (chunk > 0 && chunk < options.shared_memory_mb << 20) {
    findings.push_back({Verdict::kFail, "RouDi's largest chunk in " + roudi_toml + " is " +
                                            std::to_string(chunk) +
                                            " bytes, less than bus.shared_memory_mb: make it "
                                            "larger, or the setting smaller"});
  }
  return findings;
}

}  // namespace perdure::tools
