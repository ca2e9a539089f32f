// Simulates a calibration with exact truth: a hand moves a camera and an IMU before a board on a
// wall.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "common/sim/scene.h"
#include "tools/calibrate/estimate/board.h"
#include "tools/simulate/render/lens.h"
#include "tools/simulate/render/renderer.h"

namespace perdure::calibrate {

struct SimulatedOptions {
  Board board;
  std::uint64_t seed = 1;
  double seconds = 40.0;
  DistortionModel lens = DistortionModel::kRadialTangential;  ///< equidistant: a fisheye lens
  std::uint32_t width = 640, height = 480;
  double rate_hz = 20.0, readout_s = 0.0, exposure_s = 0.003;
  bool shake = true;  ///< false: slow motion only, for intrinsics alone
};

/// The scene's rig is the ground truth; `calibration` has the values of a data sheet. These are
/// wrong by a few per cent, degrees and centimetres, and have no time offset.
struct SimulatedCalibration {
  SimulatedOptions options;
  sim::Scene scene;
  RigidTransform T_WT;  ///< pose of the board

  const CameraCalibration& truth() const { return scene.rig.true_calibration.cameras[0]; }
  /// Stamps of the images; an image is exposed at its stamp plus the time offset.
  std::vector<TimePoint> stamps() const;
  RigidTransform T_CT(double t_s) const;
};

SimulatedCalibration simulateCalibration(const SimulatedOptions& options);

/// Simulates detected corners with noise of `sigma_px`; a chessboard is only detected as a whole.
std::vector<View> simulateViews(const SimulatedCalibration& simulated, double sigma_px);
std::vector<ImuSample> simulateSamples(const SimulatedCalibration& simulated);

/// Renders the image at `t_s` in linear light.
void drawBoard(const SimulatedCalibration& simulated, const tools::Lens& lens, double t_s,
               tools::Workers& workers, tools::Picture& picture);

/// Renders images with the sensor's noise, and returns the views that the detectors find in them.
std::vector<View> drawnViews(const SimulatedCalibration& simulated,
                             const std::function<void(std::size_t, std::size_t)>& progress = {});

/// Writes a drive in the layout of EuRoC, rig_truth.yaml and board.txt. Throws StartupError if the
/// disk reports an error.
void writeSimulated(const SimulatedCalibration& simulated, const std::filesystem::path& folder,
                    const std::function<void(std::size_t, std::size_t)>& progress);

}  // namespace perdure::calibrate
