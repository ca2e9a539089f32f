#include "tools/simulate/writer.h"

#include <fmt/format.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "common/base/checked_file.h"
#include "common/replay/files/sensor_file.h"
#include "common/sim/truth_files.h"

namespace perdure::tools {
namespace fs = std::filesystem;

void writeWhole(const fs::path& file, std::span<const char> bytes) {
  std::error_code error;
  fs::create_directories(file.parent_path(), error);
  writeChecked(file, {bytes.data(), bytes.size()});
}

std::string cameraYaml(const CameraCalibration& camera) {
  return replay::cameraYaml(camera, "simulated " + camera.name);
}

std::string imuYaml(const ImuCalibration& imu) { return replay::imuYaml(imu, "simulated"); }

std::string speedYaml(const sim::SpeedErrors& speed) {
  return fmt::format(
      "sensor_type: speed\ncomment: along the body's x axis\n\nrate_hz: {}\nsigma: {}\n",
      speed.rate_hz, speed.sigma);
}

std::string groundTruthYaml() {
  return "sensor_type: visual-inertial\ncomment: exact states of the simulated body\n\n" +
         replay::transformKey({});
}

std::string imageListCsv(const std::vector<TimePoint>& stamps, const std::string& extension) {
  std::string text = "#timestamp [ns],filename\n";
  for (const auto stamp : stamps) {
    text += fmt::format("{0},{0}{1}\n", toNanoseconds(stamp), extension);
  }
  return text;
}

std::string visibilityCsv(const std::vector<std::vector<sim::TruthView>>& views_by_frame) {
  std::string text = std::string(sim::kVisibilityHeader) + "\n";
  for (std::size_t frame = 0; frame < views_by_frame.size(); ++frame) {
    for (const auto& view : views_by_frame[frame]) {
      text +=
          fmt::format("{},{},{:.4f},{:.2f},{:.2f},{:.2f},{:.2f}\n", frame, view.object_id,
                      view.visible_fraction, view.box.x1, view.box.y1, view.box.x2, view.box.y2);
    }
  }
  return text;
}

std::string insideCsv(const std::vector<std::vector<sim::TruthView>>& views_by_frame) {
  std::string text = std::string(sim::kInsideHeader) + "\n";
  for (std::size_t frame = 0; frame < views_by_frame.size(); ++frame) {
    for (const auto& view : views_by_frame[frame]) {
      if (!view.inside) continue;
      const Box& b = *view.inside;
      text += fmt::format("{},{},{:.2f},{:.2f},{:.2f},{:.2f}\n", frame, view.object_id, b.x1, b.y1,
                          b.x2, b.y2);
    }
  }
  return text;
}

std::string extensionOf(ImageFormat format) {
  return format == ImageFormat::kPng ? ".png" : ".jpg";
}

void writeImage(const fs::path& file, int width, int height, int channels,
                const std::vector<std::uint8_t>& pixels, ImageFormat format) {
  const cv::Mat image(height, width, channels == 3 ? CV_8UC3 : CV_8UC1,
                      const_cast<std::uint8_t*>(pixels.data()));
  // zlib's level 1 with run lengths after SUB: twice as fast, smaller.
  std::vector<int> settings;
  if (format == ImageFormat::kJpeg) settings = {cv::IMWRITE_JPEG_QUALITY, 95};
  std::vector<std::uint8_t> bytes;
  if (!cv::imencode(extensionOf(format), image, bytes, settings)) {
    throw std::runtime_error(file.string() + " cannot be encoded");
  }
  writeWhole(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace perdure::tools
