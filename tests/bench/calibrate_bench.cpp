// Measures the accuracy of `perdure calibrate` on simulated recordings of both boards, with several
// seeds. Compares the errors with the standard deviations that the calibration states.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "common/math/so3.h"
#include "tools/calibrate/estimate/camera_imu.h"
#include "tools/calibrate/simulated.h"

namespace perdure::calibrate {
namespace {

constexpr double kDegrees = 180.0 / M_PI;

struct Settings {
  std::uint64_t seeds = 5;
  double seconds = 30.0, sigma_px = 0.1, readout_s = 0.0;
  bool images = false;
  std::string board, lens;
};

struct Worst {
  double focal_percent = 0, middle_percent = 0, rotation_deg = 0, position_mm = 0, offset_ms = 0;
  double nees = 0;
  std::uint64_t runs = 0;
};

/// Returns truth minus estimate, in the order of the covariance.
Eigen::Matrix<double, 15, 1> errorOf(const CameraCalibration& found,
                                     const CameraCalibration& truth) {
  Eigen::Matrix<double, 15, 1> error;
  error << logSo3(Eigen::Quaterniond(found.T_BC.q.conjugate() * truth.T_BC.q)),
      truth.T_BC.p - found.T_BC.p, truth.time_offset_s - found.time_offset_s,
      lensOf(truth) - lensOf(found);
  return error;
}

void runOne(const SimulatedOptions& options, const Settings& settings, Worst& worst) {
  const auto simulated = simulateCalibration(options);
  const auto views =
      settings.images ? drawnViews(simulated) : simulateViews(simulated, settings.sigma_px);
  const auto begin = std::chrono::steady_clock::now();
  CameraCalibration camera = simulated.scene.rig.calibration.cameras[0];
  const auto lens = estimateIntrinsics(options.board, views, camera, {options.lens, 60});
  if (!lens) {
    fmt::print("  seed {}: {}\n", options.seed, lens.error().detail);
    return;
  }
  camera.distortion = options.lens;
  setLens(lensOf(lens->camera), camera);
  const CameraImuInput input{options.board,
                             views,
                             simulateSamples(simulated),
                             camera,
                             *simulated.scene.rig.calibration.imu,
                             lens->sigma_px};
  const auto found = estimateCameraImu(input, {});
  const double took =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (!found) {
    fmt::print("  seed {}: {}\n", options.seed, found.error().detail);
    return;
  }
  const auto error = errorOf(found->camera, simulated.truth());
  const auto sigma = found->covariance.diagonal().cwiseSqrt().eval();
  const double focal = 100 / simulated.truth().fx;
  const double nees = error.dot(found->covariance.inverse() * error);
  fmt::print(
      "  seed {:<2} {:4} views {:.3f} px | fx {:+.4f} ({:.4f}) fy {:+.4f} ({:.4f}) cx {:+.4f} "
      "({:.4f}) cy {:+.4f} ({:.4f}) % | {:.4f} ({:.4f})° {:.3f} ({:.3f}) mm {:+.4f} ({:.4f}) ms | "
      "widened {:.2f} NEES {:.1f} | {:.1f} s\n",
      options.seed, found->views, found->sigma_px, focal * error[7], focal * sigma[7],
      focal * error[8], focal * sigma[8], focal * error[9], focal * sigma[9], focal * error[10],
      focal * sigma[10], kDegrees * error.head<3>().norm(), kDegrees * sigma.head<3>().norm(),
      1e3 * error.segment<3>(3).norm(), 1e3 * sigma.segment<3>(3).norm(), 1e3 * error[6],
      1e3 * sigma[6], found->widened, nees, took);
  std::fflush(stdout);
  const auto raise = [](double& most, double value) { most = std::max(most, std::abs(value)); };
  raise(worst.focal_percent, focal * error.segment<2>(7).cwiseAbs().maxCoeff());
  raise(worst.middle_percent, focal * error.segment<2>(9).cwiseAbs().maxCoeff());
  raise(worst.rotation_deg, kDegrees * error.head<3>().norm());
  raise(worst.position_mm, 1e3 * error.segment<3>(3).norm());
  raise(worst.offset_ms, 1e3 * error[6]);
  worst.nees += nees;
  ++worst.runs;
}

int runAll(const Settings& settings) {
  const std::vector<std::string> boards =
      settings.board.empty()
          ? std::vector<std::string>{"chessboard:9x6:0.05", "aprilgrid:6x6:0.088"}
          : std::vector<std::string>{settings.board};
  bool well = true;
  for (const std::string& board : boards) {
    for (const std::string lens : {"radtan", "equidistant"}) {
      if (!settings.lens.empty() && settings.lens != lens) continue;
      SimulatedOptions options;
      options.board = Board::parse(board);
      options.seconds = settings.seconds;
      options.readout_s = settings.readout_s;
      if (lens == "equidistant") options.lens = DistortionModel::kEquidistant;
      fmt::print(
          "{}, {}, {} s, {}; error (stated deviation), focal length and principal point in "
          "% of the focal length\n",
          board, lens, settings.seconds,
          settings.images ? "drawn images" : fmt::format("{} px", settings.sigma_px));
      Worst worst;
      for (options.seed = 1; options.seed <= settings.seeds; ++options.seed) {
        runOne(options, settings, worst);
      }
      const auto n = static_cast<double>(std::max<std::uint64_t>(1, worst.runs));
      fmt::print(
          "  worst: focal length {:.4f} %, principal point {:.4f} %, rotation {:.4f}°, "
          "position {:.3f} mm, time offset {:.4f} ms; mean NEES {:.1f} of 15 "
          "({} of {} runs)\n",
          worst.focal_percent, worst.middle_percent, worst.rotation_deg, worst.position_mm,
          worst.offset_ms, worst.nees / n, worst.runs, settings.seeds);
      well = well && worst.runs == settings.seeds && worst.focal_percent < 0.2 &&
             worst.middle_percent < 0.2 && worst.rotation_deg < 0.1 && worst.position_mm < 3.0 &&
             worst.offset_ms < 0.3;
    }
  }
  fmt::print("{}\n",
             well ? "within 0.2 %, 0.1°, 3 mm, 0.3 ms" : "NOT within 0.2 %, 0.1°, 3 mm, 0.3 ms");
  return well ? 0 : 1;
}

}  // namespace
}  // namespace perdure::calibrate

int main(int argc, char** argv) {
  CLI::App app("How exact perdure calibrate is on simulated recordings with exact truth");
  perdure::calibrate::Settings settings;
  app.add_option("--seeds", settings.seeds)->capture_default_str();
  app.add_option("--seconds", settings.seconds)->capture_default_str();
  app.add_option("--sigma-px", settings.sigma_px, "of the corners, without --images")
      ->capture_default_str();
  app.add_option("--readout", settings.readout_s, "seconds of a rolling shutter");
  app.add_option("--board", settings.board, "one board; else a chessboard and a grid");
  app.add_option("--lens", settings.lens, "radtan or equidistant; else both");
  app.add_flag("--images", settings.images, "draw images and find the corners in them");
  CLI11_PARSE(app, argc, argv);
  return perdure::calibrate::runAll(settings);
}
