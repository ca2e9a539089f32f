#include "tools/model/importer.h"

#include <optional>

#include "common/base/errors.h"
#include "common/base/files/access.h"
#include "common/base/subprocess.h"
#include "services/inference/core/network/network.h"
#include "services/inference/model_file.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

// Debian's interpreter. Others do not find Debian's python3-onnx.
constexpr const char* kPython = "/usr/bin/python3";

/// Returns the folder of perdure_model in the source tree or in an installation, relative to the
/// program.
std::optional<fs::path> pythonFolder() {
  std::error_code error;
  fs::path folder = fs::read_symlink("/proc/self/exe", error).parent_path();
  for (int up = 0; up < 5 && folder.has_relative_path(); ++up, folder = folder.parent_path()) {
    for (const char* there : {"tools/model", "share/perdure"}) {
      if (fs::is_regular_file(folder / there / "perdure_model/__main__.py", error)) {
        return folder / there;
      }
    }
  }
  return std::nullopt;
}

}  // namespace

fs::path importedPath(const fs::path& network, const fs::path& folder) {
  const fs::path beside = network.parent_path();
  return (folder.empty() ? beside : folder) / (network.stem().string() + ".perdure.onnx");
}

int importNetwork(const ImportRequest& request) {
  const auto folder = pythonFolder();
  if (!folder) {
    throw StartupError(ExitCode::kUnavailable,
                       "perdure_model is missing; it belongs into tools/model of the source tree, "
                       "or into share/perdure of the installation");
  }
  std::vector<std::string> words = {kPython,         "-B",    "-m",
                                    "perdure_model", "--out", request.out.string()};
  if (!request.shown.empty()) words.insert(words.end(), {"--shown", request.shown.string()});
  if (!request.reference.empty()) {
    words.insert(words.end(), {"--reference", request.reference.string()});
  }
  if (inference::hasOnnxRuntime()) words.emplace_back("--onnx-runtime");
  words.insert(words.end(), request.arguments.begin(), request.arguments.end());
  words.insert(words.end(), {"--", request.network.string()});
  if (!fs::exists(kPython)) {
    throw StartupError(ExitCode::kUnavailable,
                       std::string(kPython) + " is missing; apt-get install python3-onnx");
  }
  if (fs::is_directory(request.network)) {
    throw StartupError(ExitCode::kUnavailable, "{} {}", request.network.string(),
                       inference::whyFolderIsNoNetwork(request.network));
  }
  const std::string bytes = textOf(request.network);
  if (bytes.empty()) {
    throw StartupError(ExitCode::kData, "{} is empty, 0 bytes; fetch it again",
                       request.network.string());
  }
  if (const auto why = inference::whyNoNetwork(bytes); !why.empty()) {
    throw StartupError(ExitCode::kData, "{} {}", request.network.string(), why);
  }
  Subprocess python({.command = words, .environment = {{"PYTHONPATH", folder->string()}}});
  return python.waitForEnd();
}

}  // namespace perdure::tools
