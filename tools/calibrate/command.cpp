// `perdure calibrate`: calibrates from a board or from motion, or imports other calibrations.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <map>
#include <memory>

#include "common/base/checked_file.h"
#include "common/base/errors.h"
#include "common/replay/files/rig_file.h"
#include "tools/calibrate/calibrate.h"
#include "tools/calibrate/import.h"
#include "tools/calibrate/motion/from_motion.h"
#include "tools/calibrate/simulated.h"
#include "tools/data_check/rig_numbers.h"
#include "tools/simulate/writer.h"

namespace perdure::tools {
namespace {

using namespace perdure::calibrate;

constexpr double kDegrees = 180.0 / M_PI;

struct CommandLine {
  std::string board = "aprilgrid:6x6:0.088:0.3", lens;
  ReadOptions read;
  CalibrateOptions calibrate;
  std::string out;
  bool quiet = false;
  SimulatedOptions simulated;
};

void showProgress(const char* what, std::size_t done, std::size_t all) {
  const bool terminal = isatty(STDERR_FILENO) != 0;
  if (!terminal && done % 100 != 0) return;
  std::cerr << fmt::format("{}{} {} of {}{}", terminal ? "\r" : "", what, done, all,
                           terminal ? "\033[K" : "\n")
            << (terminal && done == all ? "\n" : "") << std::flush;
}

DistortionModel lensNamed(const std::string& name) {
  static const std::map<std::string, DistortionModel> models = {
      {"radtan", DistortionModel::kRadialTangential},
      {"equidistant", DistortionModel::kEquidistant},
      {"none", DistortionModel::kNone}};
  return models.at(name);
}

std::string lineOf(const CalibratedCamera& camera) {
  const CameraCalibration c = camera.result();
  std::string text =
      fmt::format("{}: fx {:.3f} fy {:.3f} cx {:.3f} cy {:.3f}, distortion [{:.6f}]\n", c.name,
                  c.fx, c.fy, c.cx, c.cy, fmt::join(c.distortion_coefficients, ", "));
  if (!camera.place) return text;
  const auto sigma = camera.place->covariance.diagonal().cwiseSqrt().eval();
  const Eigen::Vector3d& p = c.T_BC.p;
  text += fmt::format(
      "  position in the body [{:.5f}, {:.5f}, {:.5f}] m (± {:.2f} mm), rotation ± {:.4f}°, time "
      "offset {:.4f} ms (± {:.4f})\n",
      p.x(), p.y(), p.z(), 1e3 * sigma.segment<3>(kPositionAt).norm(),
      kDegrees * sigma.segment<3>(kRotationAt).norm(), 1e3 * c.time_offset_s,
      1e3 * sigma[kOffsetAt]);
  return text;
}

void runCalibrate(CommandLine line) {
  if (line.read.data.empty() || line.out.empty()) {
    throw StartupError(ExitCode::kUsage,
                       "give --data DRIVE, --board as it was printed, and --out DIR; perdure "
                       "calibrate board prints one");
  }
  line.calibrate.board = Board::parse(line.board);
  if (!line.lens.empty()) line.calibrate.lens = lensNamed(line.lens);
  const CalibrationDrive drive =
      readDrive(line.calibrate.board, line.read, [&](std::size_t done, std::size_t all) {
        if (!line.quiet) showProgress("image", done, all);
      });
  if (drive.samples.empty() && !line.calibrate.intrinsics_only) {
    throw StartupError(ExitCode::kUnavailable,
                       line.read.data.string() +
                           " has no inertial samples; record imu along with the images, or give "
                           "--intrinsics-only");
  }
  const Calibrated calibrated = calibrate::calibrate(drive, line.calibrate);
  writeCalibrated(calibrated, line.out);
  for (const auto& camera : calibrated.cameras) {
    std::cout << lineOf(camera);
    for (const auto& j : camera.judgements) {
      std::cout << fmt::format("  {:<9}{}\n", wordOf(j.grade), j.text);
    }
  }
  if (!drive.problem.empty()) std::cout << "left out while reading: " << drive.problem << "\n";
  const Judgements all = calibrated.all();
  std::cout << line.out << "/rig.yaml: " << summaryOf(all) << "\n";
  if (worstOf(all) == Grade::kBad) throw CLI::RuntimeError(1);
}

void runBoard(const CommandLine& line) {
  const Board board = Board::parse(line.board);
  const std::string svg = boardSvg(board);
  if (line.out.empty()) throw StartupError(ExitCode::kUsage, "give --out FILE.svg");
  writeWhole(line.out, svg);
  const Eigen::Vector2d size = 1e3 * (board.printTo() - board.printFrom());
  std::cout << fmt::format(
      "{}: {:.0f} by {:.0f} mm; print it at 100 %, glue it on something flat, measure the line "
      "under it, and calibrate with --board {}\n",
      line.out, size.x(), size.y(), board.text());
}

void runSimulate(CommandLine line) {
  if (line.out.empty()) throw StartupError(ExitCode::kUsage, "give --out DIR");
  line.simulated.board = Board::parse(line.board);
  if (!line.lens.empty()) line.simulated.lens = lensNamed(line.lens);
  writeSimulated(simulateCalibration(line.simulated), line.out,
                 [&](std::size_t done, std::size_t all) {
                   if (!line.quiet) showProgress("image", done, all);
                 });
  std::cout << line.out << ": " << line.board << ", seed " << line.simulated.seed
            << "; rig_truth.yaml is the exact rig\n";
}

void addCommon(CLI::App& app, CommandLine& line, const char* out) {
  app.add_option("--board", line.board,
                 "chessboard:COLUMNSxROWS:SQUARE (inner corners, m) or "
                 "aprilgrid:COLUMNSxROWS:TAG[:GAP] (m, share of the tag)")
      ->capture_default_str();
  app.add_option("--out", line.out, out);
}

void addLens(CLI::App& app, CommandLine& line, const char* what) {
  app.add_option("--lens", line.lens, what)
      ->check(CLI::IsMember({"radtan", "equidistant", "none"}));
  app.add_flag("--quiet", line.quiet, "No progress");
}

void addSimulate(CLI::App& app, const std::shared_ptr<CommandLine>& line) {
  CLI::App* simulate = app.add_subcommand(
      "simulate", "Draw a recording of a board with exact truth, to try a calibration on");
  addCommon(*simulate, *line, "Folder for the recording");
  addLens(*simulate, *line, "Of the camera");
  SimulatedOptions& options = line->simulated;
  simulate->add_option("--seed", options.seed, "The same seed gives the same bytes")
      ->capture_default_str();
  simulate->add_option("--seconds", options.seconds, "How long")
      ->check(CLI::Range(5.0, 600.0))
      ->capture_default_str();
  simulate->add_option("--rate", options.rate_hz, "Frames a second")
      ->check(CLI::Range(1.0, 200.0))
      ->capture_default_str();
  simulate->add_option("--exposure", options.exposure_s, "Seconds over which motion blurs")
      ->check(CLI::Range(0.0, 0.05))
      ->capture_default_str();
  simulate->add_option("--readout", options.readout_s, "Seconds of a rolling shutter")
      ->check(CLI::Range(0.0, 0.05))
      ->capture_default_str();
  simulate->callback([line] { runSimulate(*line); });
}

constexpr const char* kImportHelp = R"(
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
  for (const auto& text : request.places) places.push_back(transformOf(text));
  const auto imported = importRig(request.files, places);
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

void addImport(CLI::App& calibrate) {
  const auto request = std::make_shared<RigImportRequest>();
  CLI::App* command = calibrate.add_subcommand(
      "import", "A rig from a calibration of Kalibr, ROS, EuRoC, VINS, ORB-SLAM3 or Basalt");
  command->footer(kImportHelp);
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
  WindowOptions windows;
  std::filesystem::path out;
};

void findRig(const FromMotionRequest& request) {
  for (const auto& line : linesOf(writeMotionRig(request.data, request.windows, request.out))) {
    std::cout << line << "\n";
  }
  std::cout << "written           " << request.out.string() << "\n";
}

void addFromMotion(CLI::App& calibrate) {
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

}  // namespace

void setUpCalibrate(CLI::App& command) {
  auto line = std::make_shared<CommandLine>();
  addCommon(command, *line, "Folder for rig.yaml, calibration.json and pictures");
  addLens(command, *line, "Model of the lens (default: that of the drive's own calibration)");
  command.add_option("--data", line->read.data,
                     "Drive in front of the board (dataset folder or .mcap), or a folder of "
                     "pictures for the lens alone");
  command.add_option("--rig", line->read.rig, "Rig file to begin with, instead of the drive's own");
  command.add_option("--every", line->read.every, "Look at each N-th image only")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command.add_flag("--intrinsics-only", line->calibrate.intrinsics_only, "The lens alone");
  command.add_flag("--hold-lens", line->calibrate.place.hold_lens,
                   "Keep the lens that is estimated from the most different views");
  command.add_option("--gravity", line->calibrate.place.gravity, "At the place of recording, m/s²")
      ->check(CLI::Range(9.7, 9.9))
      ->capture_default_str();
  command
      .add_option("--max-offset", line->calibrate.place.widest_offset_s,
                  "Camera and IMU clocks differ by no more, s")
      ->check(CLI::Range(0.01, 5.0))
      ->capture_default_str();
  CLI::App* board =
      command.add_subcommand("board", "Write a board to print, as SVG, with a scale to measure");
  addCommon(*board, *line, "FILE.svg");
  board->callback([line] { runBoard(*line); });
  addSimulate(command, line);
  addImport(command);
  addFromMotion(command);
  command.require_subcommand(0, 1);
  command.final_callback([&command, line] {
    if (command.get_subcommands().empty()) runCalibrate(*line);
  });
}

}  // namespace perdure::tools
