// Turns an image upright, fits it to the network's input, and maps boxes back to the image.
#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core/mat.hpp>

#include "common/base/result.h"
#include "common/types/detections.h"
#include "common/types/sensors.h"
#include "services/inference/core/description.h"

namespace perdure::inference {

/// Returns the values of the sides (x1, y1, x2, y2) after clockwise quarter turns of the image.
/// `quarters`: 0 to 4.
std::array<double, 4> turned(const std::array<double, 4>& sides, int quarters);
/// Returns a box after clockwise quarter turns of an image of this size.
Box turned(const Box& box, int quarters, double width, double height);

/// Maps pixels of the image to pixels of the input. The image is first turned clockwise by
/// `quarters`; then x_input = x_turned · scale_x + offset_x.
struct ImageFit {
  double scale_x = 1, scale_y = 1, offset_x = 0, offset_y = 0;
  int width = 0, height = 0;  ///< size of the scaled image, without padding
  int quarters = 0;           ///< 0 to 3
  int image_width = 0, image_height = 0;

  Box toImage(const Box& b) const;
  Box toInput(const Box& b) const;
  /// Converts lengths across the four sides from input to image pixels; toInput() does the reverse.
  std::array<double, 4> toImage(const std::array<double, 4>& sides) const;
  std::array<double, 4> toInput(const std::array<double, 4>& sides) const;
};

ImageFit fitOf(const Input& input, int image_width, int image_height, int quarters = 0);

/// Returns the share of the input that is padding; 0 without letterbox.
double paddedShare(const Input& input, int image_width, int image_height, int quarters = 0);

/// Returns the input blob (1,3,H,W) of float32. Mono images are copied to all three channels. Fails
/// with "frame_malformed" if the frame's size does not match its data.
Result<cv::Mat> makeBlob(const Input& input, const Frame& frame, int quarters = 0);

/// Returns the clockwise quarter turns, 0 to 3, that make the image upright. `up_C` points against
/// gravity. Returns `present` unless the image turned by it leans by more than 55°, and if the
/// camera points up or down by more than 60°.
int uprightQuarters(const Eigen::Vector3d& up_C, int present);

}  // namespace perdure::inference
