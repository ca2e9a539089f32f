#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <filesystem>

#include "common/replay/dataset.h"
#include "services/inference/core/network/image_fit.h"
#include "services/inference/model_file.h"
#include "tools/bus_tools/doctor/doctor.h"

namespace perdure::tools {
namespace {

constexpr double kMostWaste = 1.0 / 3.0;

/// Number of clockwise quarter turns that make the images upright, from the mean specific force.
int quartersOf(const replay::Recording& recording) {
  Eigen::Vector3d up_B = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : recording.imu) up_B += sample.accel;
  const RigidTransform& T_BC = recording.calibration.cameras.front().T_BC;
  return inference::uprightQuarters(T_BC.q.conjugate() * up_B.normalized(), 0);
}

}  // namespace

std::string configuredNetwork(const std::string& folder) {
  try {
    const YAML::Node yaml = YAML::LoadFile(folder + "/inference.yaml");
    const YAML::Node path = yaml["model"] ? yaml["model"]["path"] : YAML::Node();
    return path && path.IsScalar() ? path.Scalar() : "";
  } catch (const YAML::Exception&) {
    return {};  // the file is missing, or invalid, which the service reports
  }
}

Findings checkNetworkShape(const Drive& drive, const std::string& network) {
  const auto dataset = replay::Dataset::open(
      {.path = drive.data, .sequence = drive.sequence, .rig = drive.rig, .decode = false});
  if (dataset->calibration().cameras.empty()) return {};
  const auto& camera = dataset->calibration().cameras.front();
  const auto file = inference::readModelFile(network, "", inference::standardModelFolders());
  const inference::Input& input = file.description.input;
  const int width = static_cast<int>(camera.width), height = static_cast<int>(camera.height);
  const int quarters = file.description.upright ? quartersOf(dataset->recording()) : 0;
  const double waste = inference::paddedShare(input, width, height, quarters);
  if (waste <= kMostWaste) return {};
  const bool across = quarters % 2 == 1;
  return {{Verdict::kWarn,
           fmt::format("{:.0f} % of the input of {} ({}x{}) stays grey beside images of {}x{}: "
                       "perdure model import NETWORK --input camera --image PICTURE gives it the "
                       "camera's shape",
                       100 * waste, std::filesystem::path(network).filename().string(), input.width,
                       input.height, across ? height : width, across ? width : height)}};
}

}  // namespace perdure::tools
