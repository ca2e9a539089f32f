#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "tools/bus_tools/doctor/doctor.h"
#include "tools/bus_tools/status/status.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

IdentitySeen lookAt(const std::string& folder, const std::string& name) {
  const auto identity = bus::readIdentity(folder + "/" + name);
  if (!identity) return {name, {}, identity.error().detail};
  return {name, identity->until, {}};
}

Finding findingOf(const IdentitySeen& seen) {
  if (!seen.until) return {Verdict::kFail, seen.problem};
  const std::string text =
      fmt::format("the identity {} ends {}", seen.name, bus::fromNow(*seen.until));
  if (!endsSoon(seen)) return {Verdict::kOk, text};
  return {Verdict::kWarn, text + ": `perdure security renew`, then restart its process"};
}

}  // namespace

bool endsSoon(const IdentitySeen& seen) {
  return seen.until && *seen.until - std::chrono::system_clock::now() < bus::kRenewBefore;
}

std::vector<IdentitySeen> lookAtIdentities(const std::string& folder) {
  std::vector<IdentitySeen> seen;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const bool ours = entry.is_directory(error) && access(entry.path().c_str(), X_OK) == 0;
    if (!ours || entry.path().filename() == "authority") continue;
    seen.push_back(lookAt(folder, entry.path().filename()));
  }
  std::ranges::sort(seen, [](const auto& a, const auto& b) { return a.name < b.name; });
  return seen;
}

Findings checkSecurity(const bus::Options& options) {
  if (options.security.empty()) {
    if (options.interface == "lo") return {};
    return {{Verdict::kWarn, "bus.security is off: whoever is on " + options.interface +
                                 " may read and write all topics"}};
  }
  Findings findings;
  for (const IdentitySeen& seen : lookAtIdentities(options.security)) {
    findings.push_back(findingOf(seen));
  }
  if (findings.empty()) {
    findings.push_back({Verdict::kFail, options.security +
                                            " holds no identity that this user can read; "
                                            "`perdure security init` makes them"});
  }
  std::error_code ignored;
  if (fs::exists(options.security + "/authority/key.pem", ignored)) {
    findings.push_back({Verdict::kWarn, options.security +
                                            "/authority is on this host: who takes it can make "
                                            "identities; move it to a machine that stays home"});
  }
  return findings;
}

}  // namespace perdure::tools
