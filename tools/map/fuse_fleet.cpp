#include "tools/map/fuse_fleet.h"

#include <filesystem>

#include "common/base/errors.h"
#include "services/map_store/fleet/map_transfer.h"
#include "tools/base/files.h"

namespace perdure::tools {

namespace fs = std::filesystem;

FuseOutcome fuseFleet(FuseRequest request, const std::string& url, const std::string& name) {
  const fs::path place = fs::temp_directory_path();
  const TemporaryFolder folder(place / "perdure-fleet-", [&](const std::string&) {
    throw StartupError(ExitCode::kUnavailable, "No folder for the vehicles' maps can be made in " +
                                                   place.string() +
                                                   "; set TMPDIR to one that this user may write.");
  });
  for (std::string& file : map_store::fleet::pullVehicles(url, folder.path().string())) {
    request.files.push_back(std::move(file));
  }
  if (request.out.empty()) request.out = (folder.path() / "fused").string();
  FuseOutcome outcome = fuseFiles(request);
  map_store::fleet::pushMap(outcome.out, url, name);
  outcome.out =
      name + " on the server" +
      (request.out.starts_with(folder.path().string()) ? std::string() : ", " + request.out);
  return outcome;
}

}  // namespace perdure::tools
