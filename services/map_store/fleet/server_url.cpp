#include "services/map_store/fleet/server_url.h"

#include <unistd.h>

#include <algorithm>
#include <array>

#ifdef PERDURE_HAS_LIBPQ
#include <libpq-fe.h>

#include <cstring>
#include <memory>
#include <string_view>
#endif

#include "common/base/errors.h"
#include "services/map_store/core/earth_anchor.h"

namespace perdure::map_store::fleet {
namespace {

[[noreturn]] void refuse(const std::string& sentence) {
  throw StartupError(ExitCode::kConfiguration, sentence);
}

#ifdef PERDURE_HAS_LIBPQ
[[noreturn]] void cannotBeRead(const std::string& key) {
  refuse(key +
         " cannot be read; give postgresql://USER@HOST:PORT/DATABASE, with what is special in it "
         "written as %XX.");
}

/// Whether `c` may be part of the ports, which commas separate if there are several hosts.
bool isOfPorts(char c) { return (c >= '0' && c <= '9') || c == ','; }

void checkParts(const std::string& url, const std::string& key) {
  struct Free {
    void operator()(PQconninfoOption* options) const { PQconninfoFree(options); }
    void operator()(char* text) const { PQfreemem(text); }
  };
  char* ignored = nullptr;  // libpq's message is not used, because it may repeat the URL
  const std::unique_ptr<PQconninfoOption, Free> options(PQconninfoParse(url.c_str(), &ignored));
  const std::unique_ptr<char, Free> freed(ignored);
  if (!options) cannotBeRead(key);
  for (const PQconninfoOption* each = options.get(); each->keyword != nullptr; ++each) {
    if (each->val == nullptr) continue;
    const std::string_view name = each->keyword;
    if (name == "port" && !std::all_of(each->val, each->val + std::strlen(each->val), isOfPorts)) {
      cannotBeRead(key);
    }
    if (name == "password" || name == "sslpassword") {
      refuse(key +
             " holds a password, which others could read there; put it into a file of mode "
             "0600 (HOST:PORT:DATABASE:USER:PASSWORD) and name that: "
             "postgresql://USER@HOST/DATABASE?passfile=FILE");
    }
  }
}
#endif

}  // namespace

bool isBuilt() {
#ifdef PERDURE_HAS_LIBPQ
  return true;
#else
  return false;
#endif
}

void checkName(const std::string& name, const std::string& key) {
  const bool good =
      !name.empty() && name.size() <= 100 && name[0] != '.' &&
      std::none_of(name.begin(), name.end(), [](unsigned char c) { return c < 0x20 || c == '/'; });
  if (!good) {
    refuse(key +
           " cannot be the name of a map; give 1 to 100 letters, without \"/\" and with no dot "
           "in front.");
  }
}

void checkEarthAnchor(const std::vector<double>& anchor, const std::string& key) {
  if (anchor.empty()) return;
  if (!isEarthAnchor(anchor)) {
    refuse(key +
           " is not a place on Earth; give latitude, longitude, height, yaw in degrees and metres, "
           "or nothing where it is not known.");
  }
}

void checkUrl(const std::string& url, const std::string& key) {
  if (!url.starts_with("postgresql://") && !url.starts_with("postgres://")) {
    refuse(key + " is not a URL of PostgreSQL's; give postgresql://USER@HOST:PORT/DATABASE" +
           (key == "store.url" ? ", or leave it empty." : "."));
  }
#ifdef PERDURE_HAS_LIBPQ
  checkParts(url, key);
#else
  refuse(key +
         " names a PostgreSQL server, and this program was built without PostgreSQL's "
         "library; install libpq-dev and build it again" +
         (key == "store.url" ? ", or leave store.url empty." : "."));
#endif
}

void check(const Parameters& parameters) {
  checkEarthAnchor(parameters.earth_anchor, "store.earth_anchor");
  if (!parameters.vehicle.empty()) checkName(parameters.vehicle, "store.vehicle");
  if (!parameters.url.empty()) checkUrl(parameters.url, "store.url");
}

std::string vehicleOf(const Parameters& parameters) {
  if (!parameters.vehicle.empty()) return parameters.vehicle;
  std::array<char, 256> name{};
  if (gethostname(name.data(), name.size() - 1) != 0 || name[0] == '\0') return "vehicle";
  return name.data();
}

}  // namespace perdure::map_store::fleet
