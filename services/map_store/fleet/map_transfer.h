// Copies maps between a fleet's server and files. Throws StartupError with the fix.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace perdure::map_store::fleet {

struct ServerMap {
  std::int64_t number = 0;
  std::string vehicle, file;  ///< name of the map, and identity of the map's file
  std::int64_t revision = 0, objects = 0, anchors = 0;
  bool whole = false;   ///< false while it is being sent
  std::string changed;  ///< ISO 8601, by the server's clock
};

/// Lists the maps on the server by name; for each name, the newest first.
std::vector<ServerMap> listMaps(const std::string& url);

/// Writes the newest map of `name` to `to`, which must not exist: one complete state, or nothing.
/// Beliefs and graph are bit-identical to those of the vehicle's file. `unfinished`: also accepts a
/// map that is still being sent.
void pullMap(const std::string& url, const std::string& name, const std::string& to,
             bool unfinished = false);

/// Writes the newest map of each vehicle to `folder`/NAME.sqlite; returns the new files. Leaves out
/// pushed maps and, unless `unfinished`, maps that are still being sent.
std::vector<std::string> pullVehicles(const std::string& url, const std::string& folder,
                                      bool unfinished = false);

/// Stores `from` as the map `name` on the server, in one transaction. Replaces an earlier map that
/// was pushed under this name. Refuses names that vehicles use. `from` is only read.
/// `earth_anchor`: as in parameters.h.
void pushMap(const std::string& from, const std::string& url, const std::string& name,
             const std::vector<double>& earth_anchor = {});

}  // namespace perdure::map_store::fleet
