#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "tools/calibrate/command.h"
#include "tools/calibrate/motion/from_motion.h"

namespace perdure::tools {
namespace {

constexpr const char* kMotionHelp = R"(
Finds focal length, principal point, distortion, the camera's rotation on the IMU, time offset,
readout of a rolling shutter and gyroscope bias, each with its standard deviation. Nothing need be
known but the size of the images; the calibration of DRIVE is not used.

  perdure calibrate from-motion --data DRIVE --out rig.yaml
  perdure pipeline --data DRIVE --rig rig.yaml --odometry vio ...

The camera turns to and fro about two axes or more. Status 65: the motion or the images do not
suffice; the message says what is missing.)";

struct FromMotionRequest {
  replay::DatasetOptions data;
  calibrate::WindowOptions windows;
  std::filesystem::path out;
};

void findRig(const FromMotionRequest& request) {
  for (const auto& line : calibrate::writeMotionRig(request.data, request.windows, request.out)) {
    std::cout << line << "\n";
  }
  std::cout << "written           " << request.out.string() << "\n";
}

}  // namespace

void addCalibrateFromMotion(CLI::App& calibrate) {
  const auto request = std::make_shared<FromMotionRequest>();
  CLI::App* command = calibrate.add_subcommand(
      "from-motion", "A rig from any recording that turns, without a board");
  command->footer(kMotionHelp);
  command->add_option("--data", request->data.path, "Drive with images and inertial samples")
      ->required();
  command->add_option("--rig", request->data.rig,
                      "Rig file, for a recording without calibration: sizes and noise are used");
  command->add_option("--out", request->out, "the rig file")->required()->type_name("RIG.yaml");
  command->add_option("--seconds", request->windows.until_s, "Use only the first seconds")
      ->check(CLI::PositiveNumber);
  command->callback([request] { findRig(*request); });
}

}  // namespace perdure::tools
