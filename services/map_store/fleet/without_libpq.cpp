// Stubs for a program without PostgreSQL's library. They are never called, because checkUrl()
// throws first.
#include "common/base/errors.h"
#include "services/map_store/fleet/map_transfer.h"
#include "services/map_store/fleet/replicator.h"
#include "services/map_store/fleet/server_url.h"

namespace perdure::map_store::fleet {
namespace {

[[noreturn]] void refuse(const std::string& url) {
  checkUrl(url, "--url");
  throw StartupError(ExitCode::kConfiguration, "This program was built without libpq-dev.");
}

}  // namespace

struct Replicator::Work {};

Replicator::Replicator(const Parameters& parameters, std::string, const Pace&) {
  check(parameters);
}
Replicator::~Replicator() = default;
void Replicator::wake() {}
Progress Replicator::progress() const { return {}; }
bool Replicator::finish(std::chrono::milliseconds) { return false; }

std::vector<ServerMap> listMaps(const std::string& url) { refuse(url); }
void pullMap(const std::string& url, const std::string&, const std::string&, bool) { refuse(url); }
std::vector<std::string> pullVehicles(const std::string& url, const std::string&, bool) {
  refuse(url);
}
void pushMap(const std::string&, const std::string& url, const std::string&,
             const std::vector<double>&) {
  refuse(url);
}

}  // namespace perdure::map_store::fleet
