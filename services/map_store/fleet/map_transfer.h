// Copies maps between a fleet's server and files. All functions throw StartupError with the fix.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace perdure::map_store::fleet {

struct ServerMap {
  std::int64_t number = 0;
  std::string vehicle, file;  ///< name of the map; identity of the map's file (OutboxMark)
  std::int64_t revision = 0, objects = 0, anchors = 0;
  bool whole = false;   ///< false while the map is being sent
  std::string changed;  ///< time of the last change, ISO 8601, by the server's clock
};

/// Lists the maps on the server by name. Maps of one name are in order of change, the newest first.
std::vector<ServerMap> listMaps(const std::string& url);

/// Writes the newest map of `name` to `to`, which must not exist: one consistent state, or nothing.
/// Beliefs and graph are bit-identical to those in the vehicle's file. If `unfinished`, also
/// accepts a map that is still being sent.
void pullMap(const std::string& url, const std::string& name, const std::string& to,
             bool unfinished = false);

/// Writes the newest map of each vehicle to `folder`/NAME.sqlite and returns the new files. Leaves
/// out pushed maps, and maps that are still being sent unless `unfinished`.
std::vector<std::string> pullVehicles(const std::string& url, const std::string& folder,
                                      bool unfinished = false);

/// Stores the file `from` as the map `name` on the server, in one transaction. Replaces a map that
/// was pushed under this name. Refuses names that vehicles use. `from` is only read. `earth_anchor`
/// is as in server_url.h.
void pushMap(const std::string& from, const std::string& url, const std::string& name,
             const std::vector<double>& earth_anchor = {});

}  // namespace perdure::map_store::fleet
