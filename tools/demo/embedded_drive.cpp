#include "tools/demo/embedded_drive.h"

#include <algorithm>
#include <thread>
#include <vector>

#include "common/base/errors.h"
#include "common/base/ids.h"
#include "tools/simulate/scene_digest.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

}  // namespace

SimulateOptions embeddedScene() {
  SimulateOptions options;
  options.scene = "street";
  options.seed = 1;
  options.world.seconds = 60.0;
  options.format = ImageFormat::kJpeg;
  options.threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  return options;
}

fs::path embeddedDriveFolder(const fs::path& cache) {
  const SimulateOptions o = embeddedScene();
  const std::string all = o.scene + " " + std::to_string(o.seed) + " " +
                          std::to_string(*o.world.seconds) + " " + std::to_string(o.world.width) +
                          "x" + std::to_string(o.world.height) + " " +
                          std::to_string(o.world.rate_hz) + " jpeg " + PERDURE_VERSION + " " +
                          toHex(digestOf(sim::makeScene(o.scene, o.seed, o.world)));
  return cache / ("street-" + toHex(digest(all)));
}

fs::path embeddedDrive(const fs::path& cache,
                       const std::function<void(const SimulateProgress&)>& report) {
  SimulateOptions options = embeddedScene();
  options.out = embeddedDriveFolder(cache);
  simulate(options, report);
  return options.out;
}

std::string embeddedModel(const fs::path& root) {
  std::vector<fs::path> found;
  std::error_code ignored;
  for (const fs::path& folder : {root / "models" / "demo", root / "models"}) {
    if (!found.empty()) break;
    for (const auto& entry : fs::directory_iterator(folder, ignored)) {
      if (entry.path().extension() == ".onnx") found.push_back(entry.path());
    }
  }
  if (found.size() == 1) return found.front().string();
  throw StartupError(ExitCode::kUsage,
                     (root / "models").string() +
                         (found.empty() ? " holds no network" : " holds more than one network") +
                         "; give --model FILE.onnx, the network that looks at images");
}

}  // namespace perdure::tools
