#include "services/inference/core/network/image_fit.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace perdure::inference {
namespace {

constexpr std::uint32_t kMaxSide = 16384;

Result<cv::Mat> viewOf(const Frame& frame) {
  const std::size_t size = std::size_t{frame.width} * frame.height * channelsOf(frame.encoding);
  if (frame.width == 0 || frame.height == 0 || frame.width > kMaxSide || frame.height > kMaxSide ||
      !frame.data || frame.data->size() != size) {
    return fail("frame_malformed", "the image's size and its data do not agree");
  }
  const int type = frame.encoding == ImageEncoding::kBgr8 ? CV_8UC3 : CV_8UC1;
  // OpenCV has no view of constant data; this code does not write to it.
  auto* data = const_cast<std::uint8_t*>(frame.data->data());
  return cv::Mat(static_cast<int>(frame.height), static_cast<int>(frame.width), type, data);
}

/// Converts interleaved 8-bit BGR of the input's size to float planes in the network's colour
/// order.
cv::Mat toPlanes(const Input& input, const cv::Mat& bgr) {
  const int sizes[] = {1, 3, input.height, input.width};
  cv::Mat blob(4, sizes, CV_32F);
  const auto plane = static_cast<std::size_t>(input.width) * static_cast<std::size_t>(input.height);
  for (std::size_t c = 0; c < 3; ++c) {
    cv::Mat target(input.height, input.width, CV_32F, blob.ptr<float>() + c * plane);
    cv::Mat channel;
    cv::extractChannel(bgr, channel, static_cast<int>(input.rgb ? 2 - c : c));
    channel.convertTo(target, CV_32F, input.scale[c], -input.mean[c] * input.scale[c]);
  }
  return blob;
}

}  // namespace

ImageFit fitOf(const Input& input, int image_width, int image_height) {
  ImageFit fit;
  fit.width = input.width;
  fit.height = input.height;
  if (input.fit != Fit::kResize) {
    const double scale = std::min(static_cast<double>(input.width) / image_width,
                                  static_cast<double>(input.height) / image_height);
    fit.width = std::clamp(static_cast<int>(image_width * scale + 1e-9), 1, input.width);
    fit.height = std::clamp(static_cast<int>(image_height * scale + 1e-9), 1, input.height);
  }
  if (input.fit == Fit::kLetterboxCentre) {
    fit.offset_x = (input.width - fit.width) / 2;
    fit.offset_y = (input.height - fit.height) / 2;
  }
  fit.scale_x = static_cast<double>(fit.width) / image_width;
  fit.scale_y = static_cast<double>(fit.height) / image_height;
  return fit;
}

double paddedShare(const Input& input, int image_width, int image_height) {
  const ImageFit fit = fitOf(input, image_width, image_height);
  const double all = static_cast<double>(input.width) * input.height;
  return 1.0 - static_cast<double>(fit.width) * fit.height / all;
}

Result<cv::Mat> makeBlob(const Input& input, const Frame& frame) {
  const auto view = viewOf(frame);
  if (!view) return view;
  const ImageFit fit = fitOf(input, view->cols, view->rows);
  cv::Mat canvas(input.height, input.width, view->type(), cv::Scalar::all(input.pad));
  cv::Mat target = canvas(cv::Rect(static_cast<int>(fit.offset_x), static_cast<int>(fit.offset_y),
                                   fit.width, fit.height));
  cv::resize(*view, target, target.size(), 0, 0, cv::INTER_LINEAR);
  if (canvas.channels() == 1) cv::cvtColor(canvas, canvas, cv::COLOR_GRAY2BGR);
  return toPlanes(input, canvas);
}

}  // namespace perdure::inference
