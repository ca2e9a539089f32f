// Reads an ONNX file, repairs it for OpenCV 4.6 and writes its model.json, by perdure_model.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace perdure::tools {

struct ImportRequest {
  std::filesystem::path network;
  std::filesystem::path out;           ///< the .onnx to write; its description is OUT.model.json
  std::filesystem::path shown;         ///< name of `out` in messages; empty: unchanged
  std::filesystem::path reference;     ///< a folder for checkAnswers(); empty: none is written
  std::vector<std::string> arguments;  ///< options of perdure_model: --classes, --family …
};

/// NAME.perdure.onnx in `folder`, or beside the network if that is empty.
std::filesystem::path importedPath(const std::filesystem::path& network,
                                   const std::filesystem::path& folder);

/// Exit status of the Python part, which reports. Throws StartupError (69) if it is missing.
int importNetwork(const ImportRequest& request);

struct ImportOptions {
  std::filesystem::path network, out, image;  ///< out: a folder; empty: the network's
  double threshold = 0.25;
  bool unchecked = false;
  std::vector<std::string> arguments{};  ///< options of the Python part
};

/// The complete `perdure model import`: import, comparison, test picture, output files. Prints the
/// results. Throws StartupError, or CLI::RuntimeError with the status of the Python part, which has
/// reported the error; then no file is written.
void importAndLook(const ImportOptions& options);

}  // namespace perdure::tools
