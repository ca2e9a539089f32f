// A network's files on disk: the weights and the model.json that says what they mean.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "services/inference/core/description.h"

namespace perdure::inference {

struct ModelFile {
  ModelDescription description;
  std::string network;          ///< bytes of the .onnx or .cfg
  std::string darknet_weights;  ///< bytes of the .weights, empty for ONNX
  std::uint64_t hash = 0;       ///< digest of the bytes of all files, model.json included
};

/// Reads `path` (.onnx, or .cfg with a .weights of the same stem beside it) and its description:
/// `description` where it is not empty, else the first there is of PATH.model.json,
/// model.json beside PATH, and <stem>.json in `folders`.
/// Throws StartupError (69: a file is missing; 78: it is not what it should be) with the mend.
ModelFile readModelFile(const std::string& path, const std::string& description,
                        const std::vector<std::string>& folders);

/// The description that readModelFile() takes for `path`. Throws StartupError (69).
std::string findDescription(const std::string& path, const std::vector<std::string>& folders);

/// config/models of the source tree or share/perdure/models of an installation, seen from the
/// running program, and config/models under the current folder.
std::vector<std::string> standardModelFolders();

/// Parses the text of a model.json. `file` names it in errors, and class files are beside it.
/// Throws StartupError (78) that names every fault found.
ModelDescription parseModelDescription(const std::string& text, const std::string& file);

}  // namespace perdure::inference
