#include "common/vision/image.h"

#include <cstring>
#include <opencv2/imgproc.hpp>

namespace perdure::vision {

Result<cv::Mat> viewOf(const Frame& frame) {
  if (frame.data == nullptr) return fail("image_missing", "the frame carries no pixels");
  if (isCompressed(frame.encoding)) return fail("image_malformed", "the frame is compressed");
  const std::uint64_t channels = channelsOf(frame.encoding);
  const std::uint64_t bytes = std::uint64_t{frame.width} * frame.height * channels;
  if (bytes == 0 || frame.data->size() != bytes || frame.width > 65535 || frame.height > 65535) {
    return fail("image_malformed", "the frame's size and its number of bytes disagree");
  }
  const int type = channels == 3 ? CV_8UC3 : CV_8UC1;
  auto* pixels = const_cast<std::uint8_t*>(frame.data->data());
  return cv::Mat(static_cast<int>(frame.height), static_cast<int>(frame.width), type, pixels);
}

Result<cv::Mat> monoOf(const Frame& frame) {
  auto view = viewOf(frame);
  if (!view || view->channels() == 1) return view;
  cv::Mat mono;
  cv::cvtColor(*view, mono, cv::COLOR_BGR2GRAY);
  return mono;
}

Result<cv::Mat> bgrOf(const Frame& frame) {
  auto view = viewOf(frame);
  if (!view || view->channels() == 3) return view;
  cv::Mat bgr;
  cv::cvtColor(*view, bgr, cv::COLOR_GRAY2BGR);
  return bgr;
}

Result<void> setPixels(Frame& frame, const cv::Mat& pixels) {
  if (pixels.empty() || (pixels.type() != CV_8UC1 && pixels.type() != CV_8UC3)) {
    return fail("image_malformed", "an image has one or three channels of eight bits");
  }
  const std::size_t row_bytes = static_cast<std::size_t>(pixels.cols) * pixels.elemSize();
  auto data = std::make_shared<std::vector<std::uint8_t>>(row_bytes *
                                                          static_cast<std::size_t>(pixels.rows));
  for (int row = 0; row < pixels.rows; ++row) {
    std::memcpy(data->data() + row_bytes * static_cast<std::size_t>(row), pixels.ptr(row),
                row_bytes);
  }
  frame.width = static_cast<std::uint32_t>(pixels.cols);
  frame.height = static_cast<std::uint32_t>(pixels.rows);
  frame.encoding = pixels.channels() == 3 ? ImageEncoding::kBgr8 : ImageEncoding::kMono8;
  frame.data = std::move(data);
  return {};
}

}  // namespace perdure::vision
