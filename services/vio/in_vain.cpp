#include "services/vio/in_vain.h"

namespace perdure::vio {
namespace {

std::string sizeText(std::uint32_t width, std::uint32_t height) {
  return std::to_string(width) + "×" + std::to_string(height);
}

}  // namespace

std::string otherSize(const Frame& frame, const CameraModel& model) {
  const auto width = static_cast<std::uint32_t>(model.width());
  const auto height = static_cast<std::uint32_t>(model.height());
  if (frame.width == width && frame.height == height) return {};
  return "frames of " + frame.camera + " are " + sizeText(frame.width, frame.height) +
         ", their calibration is for " + sizeText(width, height) +
         "; set the camera to that size, or calibrate it at its own";
}

}  // namespace perdure::vio
