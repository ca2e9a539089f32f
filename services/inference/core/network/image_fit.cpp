#include "services/inference/core/network/image_fit.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <utility>

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
  // cv::Mat cannot refer to constant data. The callers do not write to the image.
  auto* data = const_cast<std::uint8_t*>(frame.data->data());
  return cv::Mat(static_cast<int>(frame.height), static_cast<int>(frame.width), type, data);
}

/// Converts interleaved 8-bit BGR to float planes in the network's colour order.
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

std::array<double, 4> turned(const std::array<double, 4>& sides, int quarters) {
  std::array<double, 4> result;
  for (std::size_t i = 0; i < 4; ++i) {
    result[(i + static_cast<std::size_t>(quarters)) % 4] = sides[i];
  }
  return result;
}

Box turned(const Box& box, int quarters, double width, double height) {
  Box b = box;
  for (int i = 0; i < quarters; ++i) {
    b = {height - b.y2, b.x1, height - b.y1, b.x2};
    std::swap(width, height);
  }
  return b;
}

Box ImageFit::toImage(const Box& b) const {
  const Box upright{(b.x1 - offset_x) / scale_x, (b.y1 - offset_y) / scale_y,
                    (b.x2 - offset_x) / scale_x, (b.y2 - offset_y) / scale_y};
  const bool across = quarters % 2 == 1;
  return turned(upright, (4 - quarters) % 4, across ? image_height : image_width,
                across ? image_width : image_height);
}

Box ImageFit::toInput(const Box& b) const {
  const Box upright = turned(b, quarters, image_width, image_height);
  return {upright.x1 * scale_x + offset_x, upright.y1 * scale_y + offset_y,
          upright.x2 * scale_x + offset_x, upright.y2 * scale_y + offset_y};
}

std::array<double, 4> ImageFit::toImage(const std::array<double, 4>& sides) const {
  return turned({sides[0] / scale_x, sides[1] / scale_y, sides[2] / scale_x, sides[3] / scale_y},
                4 - quarters);
}

std::array<double, 4> ImageFit::toInput(const std::array<double, 4>& sides) const {
  const auto upright = turned(sides, quarters);
  return {upright[0] * scale_x, upright[1] * scale_y, upright[2] * scale_x, upright[3] * scale_y};
}

ImageFit fitOf(const Input& input, int image_width, int image_height, int quarters) {
  ImageFit fit;
  fit.quarters = quarters;
  fit.image_width = image_width;
  fit.image_height = image_height;
  if (quarters % 2 == 1) std::swap(image_width, image_height);
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

double paddedShare(const Input& input, int image_width, int image_height, int quarters) {
  const ImageFit fit = fitOf(input, image_width, image_height, quarters);
  const double all = static_cast<double>(input.width) * input.height;
  return 1.0 - static_cast<double>(fit.width) * fit.height / all;
}

Result<cv::Mat> makeBlob(const Input& input, const Frame& frame, int quarters) {
  const auto view = viewOf(frame);
  if (!view) return view;
  const ImageFit fit = fitOf(input, view->cols, view->rows, quarters);
  cv::Mat canvas(input.height, input.width, view->type(), cv::Scalar::all(input.pad));
  cv::Mat target = canvas(cv::Rect(static_cast<int>(fit.offset_x), static_cast<int>(fit.offset_y),
                                   fit.width, fit.height));
  if (quarters == 0) {
    cv::resize(*view, target, target.size(), 0, 0, cv::INTER_LINEAR);
  } else {
    constexpr cv::RotateFlags kTurns[] = {cv::ROTATE_90_CLOCKWISE, cv::ROTATE_180,
                                          cv::ROTATE_90_COUNTERCLOCKWISE};
    cv::Mat scaled;
    const cv::Size size = quarters == 2 ? target.size() : cv::Size(fit.height, fit.width);
    cv::resize(*view, scaled, size, 0, 0, cv::INTER_LINEAR);
    cv::rotate(scaled, target, kTurns[quarters - 1]);
  }
  if (canvas.channels() == 1) cv::cvtColor(canvas, canvas, cv::COLOR_GRAY2BGR);
  return toPlanes(input, canvas);
}

int uprightQuarters(const Eigen::Vector3d& up_C, int present) {
  constexpr double kQuarter = std::numbers::pi / 2;
  constexpr double kMargin = std::numbers::pi / 18;  // the turn changes beyond 45° plus this
  constexpr double kLeast = 0.5;                     // least share of `up_C` in the image plane
  if (!(up_C.head<2>().norm() > kLeast)) return present;
  // Clockwise turn after which `up_C` points to the top of the image, against y.
  const double turn = -std::atan2(up_C.x(), -up_C.y());
  const double lean = std::remainder(turn - present * kQuarter, 4 * kQuarter);
  if (std::abs(lean) <= kQuarter / 2 + kMargin) return present;
  return (static_cast<int>(std::lround(turn / kQuarter)) + 4) % 4;
}

}  // namespace perdure::inference
