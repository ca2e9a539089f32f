// Reads the part of a model.json that describes the network's outputs.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "services/inference/core/description.h"
#include "services/inference/json_reader.h"

namespace perdure::inference {

/// Reads activation, levels, outputs, boxes and the keys of single families into `model`, whose
/// family, input and classes must be set. File names are relative to the folder of `file`.
void readHeads(JsonReader& reader, const std::string& file, ModelDescription& model);

/// A list in a separate file, named by `key`.
struct ListFile {
  std::string key;
  std::filesystem::path path;
  std::string what;           ///< content of a line, for messages
  std::uintmax_t most_bytes;  ///< limit; a larger file was probably named by mistake
};

/// Returns the non-empty lines. Reports an error for `key` if there are none, or if the file is too
/// large.
std::vector<std::string> linesOf(const ListFile& list, JsonReader& reader);

}  // namespace perdure::inference
