
#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "common/base/checked_file.h"
#include "common/base/errors.h"
#include "common/replay/files/rig_file.h"
#include "tools/calibrate/command.h"
#include "tools/calibrate/import.h"
#include "tools/data_check/rig_numbers.h"

namespace perdure::tools {
namespace {

constexpr const char* kHelp = R"(
Reads what others have calibrated and writes a rig file of our own (--rig of pipeline and demo,
`rig` of capture).

  perdure calibrate import camchain-imucam.yaml imu.yaml --out rig.yaml        Kalibr
  perdure calibrate import ost.yaml imu.yaml --out rig.yaml \
      --T_BS "0 0 1 .05  -1 0 0 0  0 -1 0 .02  0 0 0 1"                        ROS' camera_info
  perdure calibrate import cam0/sensor.yaml imu0/sensor.yaml --out rig.yaml    EuRoC
  perdure calibrate import FILE --out rig.yaml         VINS-Mono, VINS-Fusion, ORB-SLAM3, Basalt

Lenses: pinhole with radtan, rational or equidistant distortion; omni, eucm and ds become the
equidistant lens nearest to them, where it is within half a pixel up to 85 degrees off the axis.
A key that is not known is refused: it may be what the rig needs. --ignore-unknown leaves it out.)";

struct RigImportRequest {
  std::vector<std::filesystem::path> files;
  std::vector<std::string> places;
  std::filesystem::path out;
  bool ignore_unknown = false;
};

void importTo(const RigImportRequest& request) {
  std::vector<RigidTransform> places;
  for (const auto& text : request.places) places.push_back(calibrate::transformOf(text));
  const auto imported = calibrate::importRig(request.files, places);
  if (!imported.ignored.empty() && !request.ignore_unknown) {
    std::string all;
    for (const auto& sentence : imported.ignored) all += sentence + "\n";
    throw StartupError(ExitCode::kData,
                       all + "Correct the name, remove the line, or give --ignore-unknown.");
  }
  const auto doubts = checkRigNumbers(imported.rig);
  replay::refuseFatal(doubts, request.files.front().string());
  std::string comment = "written by perdure calibrate import:";
  for (const auto& one : imported.found) comment += "\n  " + one;
  const std::string text = replay::rigText(imported.rig, comment);
  writeChecked(request.out, text);
  for (const auto& one : imported.found) std::cout << one << "\n";
  for (const auto& one : imported.ignored) std::cout << "left out: " << one << "\n";
  for (const auto& doubt : doubts) std::cout << "warning: " << doubt.text << "\n";
  if (!imported.rig.imu) {
    std::cout << "no IMU: give its yaml, too, or the noise stays that of the drive\n";
  }
  std::cout << "written   " << request.out.string()
            << "\nlook at it: perdure doctor --data DRIVE --rig " << request.out.string() << "\n";
}

}  // namespace

void addCalibrateImport(CLI::App& calibrate) {
  const auto request = std::make_shared<RigImportRequest>();
  CLI::App* command =
      calibrate.add_subcommand("import", "A rig from a calibration of Kalibr, ROS, EuRoC, VINS, ORB-SLAM3 or Basalt");
  command->footer(kHelp);
  command->add_option("files", request->files, "files of the calibration; see below")
      ->required()
      ->type_name("FILE");
  command->add_option("--out", request->out, "the rig file")->required()->type_name("RIG.yaml");
  command
      ->add_option("--T_BS", request->places,
                   "camera in the IMU's frame, 4x4 row by row, for each camera whose file does not "
                   "say it")
      ->type_name("\"16 NUMBERS\"");
  command->add_flag("--ignore-unknown", request->ignore_unknown, "leave unknown keys out");
  command->callback([request] { importTo(*request); });
}

}  // namespace perdure::tools
