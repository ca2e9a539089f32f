// Files of a network: the weights and the model.json that describes them.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "services/inference/core/description.h"

namespace perdure::inference {

struct ModelFile {
  ModelDescription description;
  std::string network;          ///< contents of the .onnx or .cfg
  std::string darknet_weights;  ///< contents of the .weights, empty for ONNX
  std::uint64_t hash = 0;       ///< digest of the contents of all files, including model.json
};

/// Reads `path` (.onnx, or .cfg with a .weights of the same stem) and its description. If
/// `description` is empty, it takes the first existing file of PATH.model.json, model.json beside
/// PATH, and <stem>.json in `folders`. Throws StartupError with the fix (69: a file is missing; 78:
/// a file is invalid).
ModelFile readModelFile(const std::string& path, const std::string& description,
                        const std::vector<std::string>& folders);

/// Describes a file that is recognised as something else than a network (a pointer of Git LFS,
/// HTML, another format), with the fix. Empty for other files.
std::string whyNoNetwork(std::string_view bytes);

/// Description that readModelFile() uses for `path`. Throws StartupError (69).
std::string findDescription(const std::string& path, const std::vector<std::string>& folders);

/// config/models of the source tree or share/perdure/models of an installation, relative to the
/// program, and config/models in the current folder.
std::vector<std::string> standardModelFolders();

/// Parses the text of a model.json. `file` names it in errors, and class files are beside it.
/// Throws StartupError (78) that names all errors.
ModelDescription parseModelDescription(const std::string& text, const std::string& file);

}  // namespace perdure::inference
