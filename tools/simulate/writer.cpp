#include "tools/simulate/writer.h"

#include <fmt/format.h>

#include <iterator>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "common/base/checked_file.h"
#include "common/replay/files/sensor_file.h"
#include "common/sim/imu.h"
#include "common/sim/truth.h"
#include "tools/simulate/render/counter_noise.h"

namespace perdure::tools {
namespace {

std::string joined(const Eigen::Vector3d& v) {
  return fmt::format("{},{},{}", v.x(), v.y(), v.z());
}

std::string imuCsv(const std::vector<sim::ImuRecord>& records) {
  std::string text =
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
      "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";
  for (const auto& record : records) {
    text += fmt::format("{},{},{}\n", toNanoseconds(record.sample.time), joined(record.sample.gyro),
                        joined(record.sample.accel));
  }
  return text;
}

std::string speedCsv(const std::vector<SpeedSample>& samples) {
  std::string text = "#timestamp [ns],speed [m s^-1]\n";
  for (const auto& sample : samples) {
    text += fmt::format("{},{}\n", toNanoseconds(sample.time), sample.speed);
  }
  return text;
}

/// Returns the body's states at the times of the inertial samples.
std::string statesCsv(const sim::Scene& scene, const std::vector<sim::ImuRecord>& records) {
  std::string text =
      "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],"
      "q_RS_z [],v_RS_R_x [m s^-1],v_RS_R_y [m s^-1],v_RS_R_z [m s^-1],b_w_RS_S_x [rad s^-1],"
      "b_w_RS_S_y [rad s^-1],b_w_RS_S_z [rad s^-1],b_a_RS_S_x [m s^-2],b_a_RS_S_y [m s^-2],"
      "b_a_RS_S_z [m s^-2]\n";
  for (const auto& record : records) {
    const auto state = scene.body.at(toSeconds(record.sample.time - kSceneEpoch));
    const Eigen::Quaterniond& q = state.T_WB.q;
    fmt::format_to(std::back_inserter(text), "{},{},{},{},{},{},{},{},{}\n",
                   toNanoseconds(record.sample.time), joined(state.T_WB.p), q.w(), q.x(), q.y(),
                   q.z(), joined(state.velocity_W), joined(record.gyro_bias),
                   joined(record.accel_bias));
  }
  return text;
}

}  // namespace

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
  // Empty settings make OpenCV use zlib's level 1 with run lengths after the filter SUB. This is
  // twice as fast as an explicit level 1, and the files are smaller.
  std::vector<int> settings;
  if (format == ImageFormat::kJpeg) settings = {cv::IMWRITE_JPEG_QUALITY, 95};
  std::vector<std::uint8_t> bytes;
  if (!cv::imencode(extensionOf(format), image, bytes, settings)) {
    throw std::runtime_error(file.string() + " cannot be encoded");
  }
  writeWhole(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

void writeSensors(const std::filesystem::path& folder, const sim::Scene& scene) {
  const std::filesystem::path mav0 = folder / "mav0";
  const ImuCalibration imu = scene.rig.calibration.imu.value_or(ImuCalibration{0, 0, 0, 0, 200.0});
  const auto records =
      sim::simulateImu(scene.body, scene.rig.true_calibration.imu.value_or(imu), scene.rig.imu,
                       mixBits(scene.seed, 0x144), scene.seconds, kSceneEpoch);
  writeWhole(mav0 / "imu0" / "sensor.yaml", imuYaml(imu));
  writeWhole(mav0 / "imu0" / "data.csv", imuCsv(records));
  const auto truth = mav0 / "state_groundtruth_estimate0";
  writeWhole(truth / "sensor.yaml", groundTruthYaml());
  writeWhole(truth / "data.csv", statesCsv(scene, records));
  if (scene.rig.speed) {
    const auto samples = sim::simulateSpeed(
        scene.body, *scene.rig.speed, mixBits(scene.seed, 0x59eed), scene.seconds, kSceneEpoch);
    writeWhole(mav0 / "speed0" / "sensor.yaml", speedYaml(*scene.rig.speed));
    writeWhole(mav0 / "speed0" / "data.csv", speedCsv(samples));
  }
  sim::writeObjectsTruth(folder, sim::truthOf(scene, kSceneEpoch));
}

}  // namespace perdure::tools
