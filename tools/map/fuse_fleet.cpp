#include "tools/map/fuse_fleet.h"

#include <stdlib.h>

#include <filesystem>
#include <system_error>

#include "common/base/errors.h"
#include "services/map_store/fleet/map_transfer.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

/// A folder that its destructor removes with its content.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (fs::temp_directory_path() / "perdure-fleet-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) {
      throw StartupError(ExitCode::kUnavailable,
                         "No folder for the vehicles' maps can be made in " +
                             fs::temp_directory_path().string() +
                             "; set TMPDIR to one that this user may write.");
    }
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

}  // namespace

FuseOutcome fuseFleet(FuseRequest request, const std::string& url, const std::string& name) {
  const TemporaryFolder folder;
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
