// The part of a model.json that says where the network's answers are and what their numbers mean.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "services/inference/core/description.h"
#include "services/inference/json_reader.h"

namespace perdure::inference {

/// activation, levels, outputs, boxes and the keys of single families, into `model`, whose family,
/// input and classes are known. Files that are named are beside `file`.
void readHeads(JsonReader& reader, const std::string& file, ModelDescription& model);

/// The lines of a text file that are not empty, without white space at their ends; none where it
/// cannot be read.
std::vector<std::string> linesOf(const std::filesystem::path& path);

}  // namespace perdure::inference
