#include <sys/timex.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "tools/bus_tools/status/status.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

std::optional<std::string> lineOf(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  if (!std::getline(in, line)) return std::nullopt;
  return line;
}

/// Reads a temperature; sysfs gives it in thousandths of a degree.
std::optional<double> celsiusOf(const fs::path& file) {
  const auto line = lineOf(file);
  if (!line) return std::nullopt;
  return 1e-3 * std::strtod(line->c_str(), nullptr);
}

std::optional<double> criticalOf(const fs::path& zone) {
  for (int i = 0; i < 16; ++i) {
    const std::string point = "trip_point_" + std::to_string(i);
    const auto type = lineOf(zone / (point + "_type"));
    if (!type) return std::nullopt;
    if (*type == "critical") return celsiusOf(zone / (point + "_temp"));
  }
  return std::nullopt;
}

std::vector<TemperatureSeen> temperatures() {
  std::vector<TemperatureSeen> result;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator("/sys/class/thermal", error)) {
    if (!entry.path().filename().string().starts_with("thermal_zone")) continue;
    const auto celsius = celsiusOf(entry.path() / "temp");
    if (!celsius) continue;
    result.push_back({lineOf(entry.path() / "type").value_or(entry.path().filename().string()),
                      *celsius, criticalOf(entry.path())});
  }
  return result;
}

}  // namespace

HostSeen lookAtHost(const std::vector<std::string>& folders, const bus::Options& options) {
  HostSeen host;
  for (const std::string& folder : folders) {
    std::error_code error;
    const fs::space_info space = fs::space(folder, error);
    if (!error) host.disks.push_back({folder, space.available, space.capacity});
  }
  host.temperatures = temperatures();
  timex status{};
  host.clock_synchronised = adjtimex(&status) != TIME_ERROR && (status.status & STA_UNSYNC) == 0;
  host.several_hosts = options.interface != "lo";
  host.closed = !options.security.empty();
  if (host.closed) host.identities = lookAtIdentities(options.security);
  return host;
}

}  // namespace perdure::tools
