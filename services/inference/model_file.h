// Files of a network: the weights and the model.json that describes them.
#pragma once

#include <cstdint>
#include <filesystem>
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
/// `description` is empty, the description is the first existing file of PATH.model.json,
/// model.json beside PATH, and <stem>.json in `folders`. Throws StartupError with the fix: 69 if a
/// file is missing, 78 if a file is invalid.
ModelFile readModelFile(const std::string& path, const std::string& description,
                        const std::vector<std::string>& folders);

/// If `bytes` are recognised as something other than a network (a Git LFS pointer, HTML, another
/// format), returns a sentence with the fix. Otherwise returns an empty string.
std::string whyNoNetwork(std::string_view bytes);
/// Says what a folder is that was given as a network ("is a network of Core ML; …").
std::string whyFolderIsNoNetwork(const std::filesystem::path& folder);

/// Returns the description that readModelFile() uses for `path`. Throws StartupError (69) if there
/// is none.
std::string findDescription(const std::string& path, const std::vector<std::string>& folders);

/// Returns config/models of the source tree or share/perdure/models of the installation, relative
/// to the program, and config/models in the current folder.
std::vector<std::string> standardModelFolders();

/// Parses the text of a model.json. `file` is its name in messages; class files are searched for in
/// the folder of `file`. Throws StartupError (78) that names all errors.
ModelDescription parseModelDescription(const std::string& text, const std::string& file);

}  // namespace perdure::inference
