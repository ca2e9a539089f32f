#include "tools/calibrate/command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <map>
#include <memory>

#include "common/base/errors.h"
#include "tools/calibrate/calibrate.h"
#include "tools/calibrate/simulated.h"
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

}  // namespace

void setUpCalibrate(CLI::App& command) {
  auto line = std::make_shared<CommandLine>();
  addCommon(command, *line, "Folder for rig.yaml, calibration.json and pictures");
  addLens(command, *line, "Model of the lens; as the drive's own calibration says where not given");
  command.add_option("--data", line->read.data,
                     "Drive in front of the board (dataset folder or .mcap), or a folder of "
                     "pictures for the lens alone");
  command.add_option("--rig", line->read.rig, "Rig file to begin with, instead of the drive's own");
  command.add_option("--every", line->read.every, "Look at each N-th image only")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command.add_flag("--intrinsics-only", line->calibrate.intrinsics_only, "The lens alone");
  command.add_flag("--hold-lens", line->calibrate.place.hold_lens,
                   "The lens stays as the most different views have it");
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
  addCalibrateImport(command);
  addCalibrateFromMotion(command);
  command.require_subcommand(0, 1);
  command.final_callback([&command, line] {
    if (command.get_subcommands().empty()) runCalibrate(*line);
  });
}

}  // namespace perdure::tools
