// One picture through the inference service's own node, and what it saw drawn into it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/types/detections.h"
#include "common/types/sensors.h"

namespace perdure::tools {

struct Sight {
  Box box;  ///< pixels of the picture
  std::string name;
  double score = 0.0;  ///< the network's own, before calibration
};

/// A picture of any format that OpenCV reads. Throws StartupError (69).
Frame readPicture(const std::filesystem::path& file);

/// A grey ramp of the size: nothing is in it.
Frame greyRamp(int width, int height);

struct Look {
  std::vector<Sight> sights;  ///< by falling score, one a box: its best class
  int input_width = 0, input_height = 0;
};

/// Throws StartupError where the network or its model.json cannot be used.
/// `frame` may be null: the grey ramp of the input's size is then looked at.
Look lookAt(const std::filesystem::path& network, const Frame* frame, double threshold);

/// Throws StartupError (64) where the name is not that of a PNG or JPEG.
void checkDrawing(const std::filesystem::path& file);

/// Writes the picture with boxes, names and scores. Throws StartupError (64, 69, 74) where it
/// cannot.
void drawSights(const Frame& frame, const std::vector<Sight>& sights,
                const std::filesystem::path& file);

}  // namespace perdure::tools
