// Runs the node of the inference service on one picture and draws its detections.
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
  double score = 0.0;  ///< the network's own score, before calibration
};

/// Reads a picture of any format that OpenCV supports. Throws StartupError (69) if it cannot be
/// read.
Frame readPicture(const std::filesystem::path& file);

/// Returns a grey ramp of the given size, without objects.
Frame greyRamp(int width, int height);

struct Look {
  std::vector<Sight> sights;  ///< by decreasing score; for each box its best class
  int input_width = 0, input_height = 0;
};

/// Returns the detections in `frame`, or in a grey ramp of the input's size if `frame` is null.
/// Throws StartupError if the network or its model.json cannot be used.
Look lookAt(const std::filesystem::path& network, const Frame* frame, double threshold);

/// Throws StartupError (64) unless the file name is that of a PNG or JPEG.
void checkDrawing(const std::filesystem::path& file);

/// Writes the picture with boxes, names and scores. Throws StartupError (64, 69, 74) on failure.
void drawSights(const Frame& frame, const std::vector<Sight>& sights,
                const std::filesystem::path& file);

}  // namespace perdure::tools
