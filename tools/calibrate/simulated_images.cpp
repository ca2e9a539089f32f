// Renders the images of simulated.h.
#include <array>
#include <cmath>
#include <opencv2/core/mat.hpp>

#include "common/base/errors.h"
#include "common/replay/files/rig_file.h"
#include "common/sim/dice.h"
#include "tools/calibrate/simulated.h"
#include "tools/simulate/render/sensor.h"
#include "tools/simulate/writer.h"

namespace perdure::calibrate {
namespace {

namespace fs = std::filesystem;

constexpr float kBlack = 0.03F, kWhite = 0.6F, kWall = 0.22F;
constexpr std::size_t kSamples = 16;  ///< samples of a pixel: 4×4 positions, each at its own time

struct Eye {
  Eigen::Matrix3f R_TC;
  Eigen::Vector3f p_TC;
};

class Painter {
 public:
  explicit Painter(const Board& board)
      : board_(board), from_(board.printFrom()), to_(board.printTo()) {}

  /// Surface at which a ray ends: 0 black, 1 white, 2 the wall.
  int ink(const Eye& eye, const Eigen::Vector3f& ray, Eigen::Vector2d& at) const {
    const Eigen::Vector3f d = eye.R_TC * ray;
    if (d.z() < 1e-3F) return 2;
    at = (eye.p_TC - d * (eye.p_TC.z() / d.z())).head<2>().cast<double>();
    const bool printed = (at.array() >= from_.array()).all() && (at.array() < to_.array()).all();
    if (!printed) return 2;
    return board_.black(at) ? 0 : 1;
  }
  float light(int ink, const Eigen::Vector2d& at) const {
    if (ink < 2) return ink == 0 ? kBlack : kWhite;
    // The wall has faint, large stains.
    const double stain = std::sin(9.1 * at.x() + 3.0 * std::sin(4.3 * at.y())) *
                         std::sin(7.7 * at.y() + 2.0 * std::sin(5.9 * at.x()));
    return kWall * static_cast<float>(1.0 + 0.12 * stain);
  }

 private:
  const Board& board_;
  Eigen::Vector2d from_, to_;
};

/// Sample positions within a pixel, ordered so that their exposure times are distributed evenly.
constexpr std::array<std::size_t, kSamples> kOrder = {0, 10, 5, 15, 2, 8, 7, 13,
                                                      1, 11, 4, 14, 3, 9, 6, 12};

}  // namespace

void drawBoard(const SimulatedCalibration& simulated, const tools::Lens& lens, double t_s,
               tools::Workers& workers, tools::Picture& picture) {
  const Painter painter(simulated.options.board);
  const double exposure = simulated.scene.rig.cameras[0].exposure_s;
  const double readout = simulated.truth().readout_s;
  const auto eyesAt = [&](double row) {
    std::array<Eye, kSamples> eyes;
    for (std::size_t i = 0; i < kSamples; ++i) {
      const double within = (static_cast<double>(i) + 0.5) / kSamples - 0.5;
      const auto T_TC = simulated.T_CT(t_s + readout * row + exposure * within).inverse();
      eyes[i] = {T_TC.R().cast<float>(), T_TC.p.cast<float>()};
    }
    return eyes;
  };
  picture.width = lens.width(), picture.height = lens.height();
  picture.radiance.assign(static_cast<std::size_t>(lens.width() * lens.height()),
                          Eigen::Vector4f::Zero());
  const auto global = eyesAt(0.0);
  workers.run(static_cast<std::size_t>(lens.height()), [&](std::size_t task) {
    const int row = static_cast<int>(task);
    const auto eyes = readout > 0.0 ? eyesAt(row / (lens.height() - 1.0) - 0.5) : global;
    for (int column = 0; column < lens.width(); ++column) {
      Eigen::Vector2d at = Eigen::Vector2d::Zero();
      float light = 0.0F;
      if (!lens.sees(column, row)) continue;
      const int first = painter.ink(eyes[0], lens.direction(column, row, -0.6F, -0.6F), at);
      bool mixed = false;
      for (const auto& eye : {eyes.front(), eyes.back()}) {
        for (const auto& [dx, dy] : {std::pair(-.6F, -.6F), {.6F, -.6F}, {-.6F, .6F}, {.6F, .6F}}) {
          mixed = mixed || painter.ink(eye, lens.direction(column, row, dx, dy), at) != first;
        }
      }
      if (!mixed) {
        painter.ink(eyes[kSamples / 2], lens.direction(column, row), at);
        light = painter.light(first, at);
      }
      for (std::size_t i = 0; mixed && i < kSamples; ++i) {
        const float dx = (static_cast<float>(kOrder[i] % 4) - 1.5F) / 4.0F;
        const float dy = (static_cast<float>(kOrder[i] / 4) - 1.5F) / 4.0F;
        const int ink = painter.ink(eyes[i], lens.direction(column, row, dx, dy), at);
        light += painter.light(ink, at) / kSamples;
      }
      picture.radiance[picture.index(column, row)].head<3>().setConstant(light);
    }
  });
}

namespace {

template <class Take>
void drawAll(const SimulatedCalibration& simulated, Take&& take) {
  tools::Workers workers(2);
  const tools::Lens lens(simulated.truth());
  tools::SensorOptions options;
  options.errors = simulated.scene.rig.cameras[0];
  options.encoding = ImageEncoding::kMono8;
  options.interval_s = 1.0 / simulated.options.rate_hz;
  options.seed = sim::seedOf("calibration images", {simulated.options.seed});
  tools::Sensor sensor(options, lens);
  tools::Picture picture;
  const auto stamps = simulated.stamps();
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    const double t_s = toSeconds(stamps[i] - tools::kSceneEpoch) + simulated.truth().time_offset_s;
    drawBoard(simulated, lens, t_s, workers, picture);
    take(i, picture, sensor.develop(picture, i, workers));
  }
}

}  // namespace

std::vector<View> drawnViews(const SimulatedCalibration& simulated,
                             const std::function<void(std::size_t, std::size_t)>& progress) {
  const auto stamps = simulated.stamps();
  std::vector<View> views;
  drawAll(simulated, [&](std::size_t i, const tools::Picture& picture, auto&& pixels) {
    const cv::Mat grey(picture.height, picture.width, CV_8UC1, pixels.data());
    View view{i, stamps[i], findCorners(simulated.options.board, grey)};
    if (!view.corners.empty()) views.push_back(std::move(view));
    if (progress) progress(i + 1, stamps.size());
  });
  return views;
}

void writeSimulated(const SimulatedCalibration& simulated, const fs::path& folder,
                    const std::function<void(std::size_t, std::size_t)>& progress) {
  if (fs::exists(folder) && !fs::is_empty(folder)) {
    throw StartupError(ExitCode::kUsage,
                       folder.string() + " is not empty; give --out a new folder");
  }
  const sim::Rig& rig = simulated.scene.rig;
  const fs::path camera = folder / "mav0" / "cam0";
  const auto stamps = simulated.stamps();
  const auto text = [](const fs::path& file, const std::string& content) {
    tools::writeWhole(file, content);
  };
  text(camera / "sensor.yaml", tools::cameraYaml(rig.calibration.cameras[0]));
  text(camera / "data.csv", tools::imageListCsv(stamps, ".png"));
  text(folder / "board.txt", simulated.options.board.text() + "\n");
  text(folder / "rig_truth.yaml", replay::rigText(rig.true_calibration, "the exact rig"));
  tools::writeSensors(folder, simulated.scene);
  drawAll(simulated, [&](std::size_t i, const tools::Picture& picture, auto&& pixels) {
    const auto file = camera / "data" / (std::to_string(toNanoseconds(stamps[i])) + ".png");
    tools::writeImage(file, picture.width, picture.height, 1, pixels, tools::ImageFormat::kPng);
    if (progress) progress(i + 1, stamps.size());
  });
}

}  // namespace perdure::calibrate
