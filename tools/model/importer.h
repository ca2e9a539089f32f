// Looks at an ONNX file, repairs it for OpenCV 4.6 and writes its model.json, by the Python part
// beside it (perdure_model, which needs Debian's python3-onnx).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace perdure::tools {

struct ImportRequest {
  std::filesystem::path network;
  std::filesystem::path out;           ///< the .onnx to write; its description is OUT.model.json
  std::filesystem::path shown;         ///< what messages call `out`; empty: as it is
  std::filesystem::path reference;     ///< a folder for checkAnswers(); empty: none is written
  std::vector<std::string> arguments;  ///< of perdure_model: --classes, --family …
};

/// NAME.perdure.onnx in `folder`, or beside the network where that is empty.
std::filesystem::path importedPath(const std::filesystem::path& network,
                                   const std::filesystem::path& folder);

/// Returns the exit status of the Python part, which has told what it did, or what is wrong.
/// Throws StartupError (69) where Python or the Python part is missing.
int importNetwork(const ImportRequest& request);

}  // namespace perdure::tools
