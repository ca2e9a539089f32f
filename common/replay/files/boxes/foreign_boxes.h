// Recognises formats of boxes that are not read, and names the way to convert them. Internal to
// common/replay.
#pragma once

#include <filesystem>
#include <vector>

#include "common/replay/files/boxes/detection_file.h"
#include "common/replay/files/text_file.h"

namespace perdure::replay {

/// Refuses a folder with one file of labels for each image.
void refuseFolder(const DetectionFileOptions& options);
/// Refuses files that are no tables, and lines in which all numbers after the first one or two lie
/// between 0 and 1.
void refuseForeign(const std::filesystem::path& file, const std::vector<TextLine>& lines);
/// Refuses lines with corners instead of MOT's width and height, or with corners from the second
/// column on. Small coordinates fit both formats; they are accepted as MOT's if all boxes then lie
/// inside the image.
void refuseCorners(const DetectionFileOptions& options, const std::vector<TextLine>& lines);

}  // namespace perdure::replay
