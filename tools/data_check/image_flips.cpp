#include "tools/data_check/image_flips.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "tools/data_check/axis_changes.h"

namespace perdure::tools {
namespace {

struct ImageFlip {
  const char* name;
  Eigen::Vector3i signs;  ///< of the rotation about the camera's x, y, z
};

const std::array<ImageFlip, 3>& imageFlips() {
  static const std::array<ImageFlip, 3> kAll{
      {{"mirrored left to right, as a webcam shows its user", {1, -1, -1}},
       {"upside down (turned by 180°)", {-1, -1, 1}},
       {"mirrored top to bottom, with their rows in reverse order", {-1, 1, -1}}}};
  return kAll;
}

/// The sign of the images' rotation about each axis of C relative to the gyroscope's; 0 if unknown.
Eigen::Vector3i signsOf(const std::vector<Turn>& turns, std::vector<ImuSample> samples,
                        CameraCalibration camera) {
  constexpr double kSeen = 0.4, kSurely = 4.0;
  for (ImuSample& sample : samples) sample.gyro = camera.T_BC.q.conjugate() * sample.gyro;
  camera.T_BC.q.setIdentity();  // the gyroscope's axes are those of C now
  const AxisCorrelation found = correlationOfAxes(turns, samples, camera);
  const double least = std::max(kSeen, kSurely / std::sqrt(static_cast<double>(found.count + 1)));
  Eigen::Vector3i signs = Eigen::Vector3i::Zero();
  for (int i = 0; i < 3; ++i) {
    const double one = found.of(i, i);
    if (std::abs(one) < least || std::abs(one) < found.of.row(i).cwiseAbs().maxCoeff()) continue;
    signs[i] = one > 0.0 ? 1 : -1;
  }
  return signs;
}

std::string axesOf(const Eigen::Vector3i& signs, int sign) {
  std::string axes;
  for (int i = 0; i < 3; ++i) {
    if (signs[i] == sign) axes += fmt::format("{}{}", axes.empty() ? "" : " and ", "xyz"[i]);
  }
  return axes;
}

/// Half a turn of the IMU about an axis of the camera has the same signs as a flip. Returns the fix
/// for it if gravity permits the half turn.
std::string turnedImu(const Eigen::Vector3i& signs, const std::vector<ImuSample>& samples,
                      const CameraCalibration& camera) {
  constexpr double kAlong = 0.5;
  if (axesOf(signs, 1).size() != 1) return {};
  Eigen::Index axis = 0;
  signs.maxCoeff(&axis);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : samples) sum += sample.accel;
  const Eigen::Vector3d up_C = camera.T_BC.q.conjugate() * sum.normalized();
  const bool upright = up_C.y() < -kAlong;  // as given; after a half turn about x or z it is not
  if (axis != 1 && upright) return {};
  const Eigen::Vector3d axis_B = camera.T_BC.q * Eigen::Vector3d::Unit(axis);
  Eigen::Index of_body = 0;
  axis_B.cwiseAbs().maxCoeff(&of_body);
  return fmt::format(
      "turn the IMU by 180° about its {} (as it is mounted or in T_BS), which the "
      "turning shows equally, or ",
      "xyz"[of_body]);
}

}  // namespace

replay::DataFindings judgeFlips(const std::vector<Turn>& turns,
                                const std::vector<ImuSample>& samples,
                                const CameraCalibration& camera) {
  const Eigen::Vector3i signs = signsOf(turns, samples, camera);
  if (signs.minCoeff() >= 0) return {};
  std::string names;
  for (const ImageFlip& flip : imageFlips()) {
    const bool fits = (signs.array() == 0 || signs.array() == flip.signs.array()).all();
    if (fits) names += fmt::format("{}{}", names.empty() ? "" : ", or ", flip.name);
  }
  if (names.empty()) return {};
  const std::string turned = turnedImu(signs, samples, camera);
  const std::string with = axesOf(signs, 1), unknown = axesOf(signs, 0);
  return {{replay::DataFinding::Grade::kCause, "images_flipped",
           fmt::format(
               "the images of {} seem to be {}: about the camera's {} they turn against the "
               "gyroscope{}{}; turn them back, or, if they are right, {}see T_BS and the signs of "
               "the gyroscope's columns",
               camera.name, names, axesOf(signs, -1),
               with.empty() ? "" : ", about " + with + " with it",
               unknown.empty() ? "" : " (about " + unknown + " too little to say)", turned)}};
}

}  // namespace perdure::tools
