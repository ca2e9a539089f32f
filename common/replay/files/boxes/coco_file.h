// Detections in COCO's JSON: a list of results, {image_id, category_id, bbox: [x, y, width,
// height], score}, or an object with such `annotations`, and `categories` and `images`. Internal to
// common/replay.
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
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
  double score = 1.0;  ///< 1 for annotations without a score
};

struct CocoBoxes {
  std::vector<CocoBox> boxes;
  std::optional<std::set<std::uint64_t>> frames;  ///< the `images`, if there are any
  std::string note;  ///< a sentence if the frame numbers count from 1, or may count from 1
};

/// The frame of an image that the drive does not have.
inline constexpr std::uint64_t kNoFrame = std::numeric_limits<std::uint64_t>::max();

/// Whether a file with this first line is JSON.
bool looksLikeCoco(std::string_view first_line);

/// The frame of an image is that of the drive whose image has the same name (`numbers`); if there is
/// none, the number in its file name, or its id. These count from 1 if they reach one beyond the
/// drive's last frame, or are the numbers 1 … n of all `images`. `class_name` is that of boxes whose
/// category has no name. Throws StartupError with the place and the fix.
CocoBoxes readCoco(const std::filesystem::path& file, const std::string& class_name,
                   const std::map<std::string, std::uint64_t>& numbers);

}  // namespace perdure::replay
