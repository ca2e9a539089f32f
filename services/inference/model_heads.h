// The part of a model.json that says where the network's answers are and what their numbers mean.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "services/inference/core/description.h"
#include "services/inference/json_reader.h"

namespace perdure::inference {

/// activation, levels, outputs, boxes and the keys of single families, into `model`, whose family,
/// input and classes are known. Files that are named are beside `file`.
void readHeads(JsonReader& reader, const std::string& file, ModelDescription& model);

/// A list in a file of its own, named by `key`.
struct ListFile {
  std::string key;
  std::filesystem::path path;
  std::string what;           ///< of which it has one a line, for people
  std::uintmax_t most_bytes;  ///< no list is longer; a file that is was named by mistake
};

/// Its lines that are not empty, without white space at their ends. Complains of `key` where there
/// are none, or the file is larger.
std::vector<std::string> linesOf(const ListFile& list, JsonReader& reader);

}  // namespace perdure::inference
