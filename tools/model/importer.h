// Imports an ONNX file with perdure_model, which repairs it for OpenCV 4.6 and writes its
// model.json.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace perdure::tools {

struct ImportRequest {
  std::filesystem::path network;
  std::filesystem::path out;           ///< the .onnx to write; its description is OUT.model.json
  std::filesystem::path shown;         ///< name of `out` in messages; empty: `out`
  std::filesystem::path reference;     ///< folder for the data of checkAnswers(); empty: none
  std::vector<std::string> arguments;  ///< options of perdure_model: --classes, --family …
};

/// Returns NAME.perdure.onnx in `folder`, or beside the network if `folder` is empty.
std::filesystem::path importedPath(const std::filesystem::path& network,
                                   const std::filesystem::path& folder);

/// Returns the exit status of the Python part, which prints results and errors. Throws StartupError
/// (69) if the Python part is missing.
int importNetwork(const ImportRequest& request);

struct ImportOptions {
  std::filesystem::path network, out, image;  ///< out: a folder; empty: that of the network
  double threshold = 0.25;
  bool unchecked = false;
  std::vector<std::string> arguments{};  ///< options of the Python part
};

/// The complete `perdure model import`: import, comparison, test picture, output files. Prints the
/// results. Throws StartupError, or CLI::RuntimeError with the exit status of the Python part,
/// which then has printed the error. After an error no file is written.
void importAndLook(const ImportOptions& options);

}  // namespace perdure::tools
