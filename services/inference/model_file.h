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

/// Reads `path` (.onnx, or .cfg with a .weights) and its description; if that is empty,
/// PATH.model.json, model.json beside PATH, or <stem>.json in `folders`. Throws StartupError (69:
/// missing; 78: invalid).
ModelFile readModelFile(const std::string& path, const std::string& description,
                        const std::vector<std::string>& folders);

/// What a file is that is no network (a pointer of Git LFS, HTML), with the fix; else empty.
std::string whyNoNetwork(std::string_view bytes);

/// Description that readModelFile() uses for `path`. Throws StartupError (69).
std::string findDescription(const std::string& path, const std::vector<std::string>& folders);

/// config/models of the source tree, the installation and the current folder.
std::vector<std::string> standardModelFolders();

/// `file` names the text in errors; class files are beside it. Throws StartupError (78).
ModelDescription parseModelDescription(const std::string& text, const std::string& file);

}  // namespace perdure::inference
