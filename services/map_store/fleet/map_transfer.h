// Maps on a fleet's server as files, and files as maps there. Throws StartupError with the mend.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace perdure::map_store::fleet {

/// One map on the server.
struct ServerMap {
  std::int64_t number = 0;
  std::string vehicle, file;  ///< name, and the identity of the map's file
  std::int64_t revision = 0, objects = 0, anchors = 0;
  bool whole = false;   ///< false while it is in the midst of being sent
  std::string changed;  ///< ISO 8601, the server's clock
};

/// What the server has, by name, the newest of each name first.
std::vector<ServerMap> listMaps(const std::string& url);

/// Writes the newest map of `name` to `to`, which must not exist: whole, of one moment, or not at
/// all. Beliefs and graph are those of the vehicle's file bit by bit. `unfinished`: also one that
/// is in the midst of being sent.
void pullMap(const std::string& url, const std::string& name, const std::string& to,
             bool unfinished = false);

/// The newest map of each vehicle, as `folder`/NAME.sqlite: the new files. What was pushed is left
/// out, and what is in the midst of being sent unless `unfinished`.
std::vector<std::string> pullVehicles(const std::string& url, const std::string& folder,
                                      bool unfinished = false);

/// Makes the map `name` on the server what `from` holds, in one transaction; an earlier one that
/// was pushed under this name is replaced. Refuses names that vehicles use. `from` is only read.
/// `earth_anchor`: as in parameters.h.
void pushMap(const std::string& from, const std::string& url, const std::string& name,
             const std::vector<double>& earth_anchor = {});

}  // namespace perdure::map_store::fleet
