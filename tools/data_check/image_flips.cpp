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
  const std::string with = axesOf(signs, 1), unknown = axesOf(signs, 0);
  return {{replay::DataFinding::Grade::kWarning, "images_flipped",
           fmt::format(
               "the images of {} seem to be {}: about the camera's {} they turn against the "
               "gyroscope{}{}; turn them back, or, if they are right, see T_BS and the signs of "
               "the gyroscope's columns",
               camera.name, names, axesOf(signs, -1),
               with.empty() ? "" : ", about " + with + " with it",
               unknown.empty() ? "" : " (about " + unknown + " too little to say)")}};
}

}  // namespace perdure::tools
