// Detections in COCO's JSON: a list of results, {image_id, category_id, bbox: [x, y, width,
// height], score}, or an object with such `annotations`, and `categories` and `images`. Internal to
// common/replay.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/types/detections.h"

namespace perdure::replay {

struct CocoBox {
  std::string name;  ///< for messages: "annotation 12"
  std::uint64_t frame = 0;
  std::string class_name;
  Box box;
  double score = 1.0;  ///< annotations may have none
};

struct CocoBoxes {
  std::vector<CocoBox> boxes;
  std::optional<std::set<std::uint64_t>> frames;  ///< the `images`, if there are any
};

/// Whether a file with this first line is JSON.
bool looksLikeCoco(std::string_view first_line);

/// The frame of an image is the number in its file name (`images`), or its id. `class_name` is that
/// of boxes whose category has no name. Throws StartupError with the place and the fix.
CocoBoxes readCoco(const std::filesystem::path& file, const std::string& class_name);

}  // namespace perdure::replay
