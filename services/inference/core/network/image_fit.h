// Fits an image to the network's input, and maps boxes back to the image.
#pragma once

#include <array>
#include <opencv2/core/mat.hpp>

#include "common/base/result.h"
#include "common/types/detections.h"
#include "common/types/sensors.h"
#include "services/inference/core/description.h"

namespace perdure::inference {

/// Maps pixels of the image to pixels of the input: x_input = x_image · scale_x + offset_x.
struct ImageFit {
  double scale_x = 1, scale_y = 1, offset_x = 0, offset_y = 0;
  int width = 0, height = 0;  ///< size of the scaled image, without padding

  Box toImage(const Box& b) const {
    return {(b.x1 - offset_x) / scale_x, (b.y1 - offset_y) / scale_y, (b.x2 - offset_x) / scale_x,
            (b.y2 - offset_y) / scale_y};
  }
  Box toInput(const Box& b) const {
    return {b.x1 * scale_x + offset_x, b.y1 * scale_y + offset_y, b.x2 * scale_x + offset_x,
            b.y2 * scale_y + offset_y};
  }
  std::array<double, 4> toImage(const std::array<double, 4>& sides) const {
    return {sides[0] / scale_x, sides[1] / scale_y, sides[2] / scale_x, sides[3] / scale_y};
  }
};

ImageFit fitOf(const Input& input, int image_width, int image_height);

/// Share of the input outside the image; 0 without letterbox.
double paddedShare(const Input& input, int image_width, int image_height);

/// Input blob (1,3,H,W) of float32. Mono images are repeated in all three channels. Fails with
/// "frame_malformed" if the frame's size does not match its data.
Result<cv::Mat> makeBlob(const Input& input, const Frame& frame);

}  // namespace perdure::inference
