// Reads detections in COCO's JSON: a list of results, {image_id, category_id, bbox: [x, y, width,
// height], score}, or an object with `annotations` of this form, `categories` and `images`.
// Internal to common/replay.
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
  std::string name;  ///< name in messages: "annotation 12"
  std::uint64_t frame = 0;
  std::string class_name;
  Box box;
  double score = 1.0;  ///< 1 for annotations without a score
};

struct CocoBoxes {
  std::vector<CocoBox> boxes;
  std::optional<std::set<std::uint64_t>>
      frames;        ///< frames of the `images`; nothing if the file lists no images
  std::string note;  ///< a sentence if the frame numbers count from 1, or may count from 1
};

/// Stands for the frame of an image that the drive does not have.
inline constexpr std::uint64_t kNoFrame = std::numeric_limits<std::uint64_t>::max();

/// Returns whether a file with this first line is JSON.
bool looksLikeCoco(std::string_view first_line);

/// Finds the frame of an image by its name among those of the drive (`numbers`). If no image has
/// such a name, the number in the file name is used, or else the id. These numbers count from 1 if
/// they begin at 1 and reach one beyond the drive's last frame, or if they are 1 … n for n
/// `images`. `class_name` is the class of boxes whose category has no name. Throws StartupError
/// with the place and the fix.
CocoBoxes readCoco(const std::filesystem::path& file, const std::string& class_name,
                   const std::map<std::string, std::uint64_t>& numbers);

}  // namespace perdure::replay
