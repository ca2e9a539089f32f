// Measures `perdure calibrate from-motion` on simulated recordings of a handheld camera, in rooms
// and in streets, with drawn lenses, mountings, time offsets and readouts. Compares the errors with
// the standard deviations that the estimate states.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <cstdio>

#include "common/camera/camera_model.h"
#include "common/math/so3.h"
#include "common/sim/dice.h"
#include "tools/calibrate/motion/from_motion.h"
#include "tools/simulate/simulate.h"

namespace perdure::calibrate {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

constexpr double kDegrees = 180.0 / M_PI;
constexpr double kRate_hz = 15.0;
constexpr std::uint32_t kWidth = 480, kHeight = 360;

struct Settings {
  std::uint64_t first = 1, last = 20, step = 1;
  double seconds = 16.0;
  bool car = false;
  fs::path cache = "build/motion_bench";
};

/// A usual lens with this horizontal field of view.
struct LensKind {
  double view_deg, k1, k2;
};
constexpr std::array<LensKind, 6> kLenses{{{50.0, 0.08, -0.15},
                                           {62.0, 0.10, -0.12},
                                           {74.0, -0.06, 0.03},
                                           {86.0, -0.12, 0.03},
                                           {98.0, -0.20, 0.04},
                                           {110.0, -0.24, 0.05}}};

struct Draw {
  sim::Scene scene;
  double view_deg = 0.0;
  Vector3d swing_deg;  ///< amplitudes of yaw, pitch and roll
  int mounting = 0;    ///< 0 … 23
  const CameraCalibration& truth() const { return scene.rig.true_calibration.cameras.front(); }
};

/// The rotation with this number among the 24 that map axes to axes.
Eigen::Matrix3d mountingOf(int number) {
  const int x = number / 4, y = number % 4;
  Eigen::Matrix3d R;
  R.col(0) = (x % 2 ? -1.0 : 1.0) * Vector3d::Unit(x / 2);
  R.col(1) = (y % 2 ? -1.0 : 1.0) * Vector3d::Unit((x / 2 + 1 + y / 2) % 3);
  R.col(2) = R.col(0).cross(R.col(1));
  return R;
}

/// Sets focal length, principal point and distortion.
void setLens(const LensKind& kind, sim::Dice& dice, CameraCalibration& camera) {
  const double strength = dice.uniform(0.3, 1.0), width = camera.width;
  camera.distortion = DistortionModel::kRadialTangential;
  camera.distortion_coefficients = {strength * kind.k1, strength * kind.k2, 3e-4 * dice.normal(),
                                    3e-4 * dice.normal()};
  camera.cx = 0.5 * (width - 1.0) + 0.006 * width * dice.normal();
  camera.cy = 0.5 * (camera.height - 1.0) + 0.006 * width * dice.normal();
  camera.fx = camera.fy = 1.0;
  const double x = std::tan(0.5 * kind.view_deg / kDegrees);
  const double edge = CameraModel(camera).distort({x, 0.0}).x() - camera.cx;
  camera.fx = camera.fy = 0.5 * width / edge;
}

/// The carrier K (x forward, z up) goes along the scene's own path and swings about its three axes.
std::vector<RigidTransform> swung(const sim::Trajectory& path, double from_s, double pace,
                                  const Vector3d& swing, double seconds, sim::Dice& dice,
                                  double interval_s) {
  std::array<double, 12> shift{}, hertz{};
  for (double& one : shift) one = dice.uniform(0.0, 2.0 * M_PI);
  for (double& one : hertz) one = dice.uniform(0.35, 0.6);
  const auto wave = [&](std::size_t i, double t) {
    return 0.8 * std::sin(2.0 * M_PI * hertz[i] * t + shift[i]) +
           0.3 * std::sin(2.0 * M_PI * 1.7 * hertz[i + 6] * t + shift[i + 6]);
  };
  std::vector<RigidTransform> poses;
  for (double t = -1.0; t < seconds + 1.0; t += interval_s) {
    RigidTransform T = path.poseAt(from_s + pace * t);
    T.q = T.q * expQuaternion({0, 0, swing.x() * wave(0, t)}) *
          expQuaternion({0, swing.y() * wave(1, t), 0}) *
          expQuaternion({swing.z() * wave(2, t), 0, 0});
    T.p += 0.06 * Vector3d(wave(3, t), wave(4, t), wave(5, t));  // the hand's sway
    poses.push_back(T);
  }
  return poses;
}

Draw drawOf(std::uint64_t seed, const Settings& settings) {
  sim::Dice dice(sim::seedOf("motion_bench", {seed}));
  sim::SceneOptions options;
  options.mono8 = true, options.rate_hz = kRate_hz;
  options.width = kWidth, options.height = kHeight;
  const bool street = settings.car || seed % 4 >= 2;
  Draw draw;
  draw.scene = sim::makeScene(street ? "street" : "room", seed, options);
  draw.scene.name = settings.car ? "motion_bench_car" : "motion_bench";
  draw.scene.seconds = settings.seconds;
  const LensKind& kind = kLenses[dice.below(kLenses.size())];
  draw.view_deg = kind.view_deg;
  draw.mounting = static_cast<int>(dice.below(24));
  draw.swing_deg = {dice.uniform(6, 20), dice.uniform(4, 15), dice.uniform(3, 12)};
  if (settings.car) draw.swing_deg.setZero();

  sim::Rig& rig = draw.scene.rig;
  CameraCalibration& truth = rig.true_calibration.cameras.front();
  const RigidTransform T_KC = truth.T_BC;
  const RigidTransform T_KB(
      Eigen::Matrix3d(expSo3(0.04 * Vector3d(dice.normal(), dice.normal(), dice.normal())) *
                      mountingOf(draw.mounting)),
      0.03 * Vector3d(dice.normal(), dice.normal(), dice.normal()));
  truth.T_BC = T_KB.inverse() * T_KC;
  setLens(kind, dice, truth);
  truth.time_offset_s = dice.uniform(-0.06, 0.06);
  truth.readout_s = dice.chance(0.25) ? 0.0 : dice.uniform(0.005, 0.033);
  rig.cameras.front().exposure_s = dice.uniform(0.004, 0.012);
  rig.imu.gyro_bias = 0.01 * Vector3d(dice.normal(), dice.normal(), dice.normal());
  rig.imu.accel_bias = 0.1 * Vector3d(dice.normal(), dice.normal(), dice.normal());
  rig.speed.reset();
  rig.calibration.has_speed = rig.true_calibration.has_speed = false;

  constexpr double kInterval_s = 0.02;
  const double pace = settings.car ? 1.0 : street ? dice.uniform(0.1, 0.2) : dice.uniform(0.4, 1.0);
  auto poses = swung(draw.scene.body, 2.0 + dice.uniform(0.0, 15.0), pace,
                     draw.swing_deg / kDegrees, settings.seconds, dice, kInterval_s);
  for (RigidTransform& T : poses) T = T * T_KB;
  draw.scene.body = sim::Trajectory(-1.0, kInterval_s, std::move(poses));
  return draw;
}

/// Renders the recording into the cache if it is not there.
fs::path recordingOf(const Draw& draw, std::uint64_t seed, const Settings& settings) {
  tools::SimulateOptions options;
  options.out = settings.cache / fmt::format("{}{:02}", settings.car ? "car" : "", seed);
  options.world.mono8 = true, options.world.rate_hz = kRate_hz;
  options.world.width = kWidth, options.world.height = kHeight;
  options.threads = 1;
  tools::simulate(draw.scene, options, {});
  return options.out;
}

/// Errors and stated deviations: focal length in %, rotation in degrees, offset and readout in ms.
struct Outcome {
  Eigen::Array4d error, sigma;
  double turn_nees = 0.0;  ///< of the three angles, divided by three
};

Outcome outcomeOf(const JointEstimate& found, const CameraCalibration& truth) {
  const JointVector e = between({truth, found.state.gyro_bias}, found.state), &s = found.sigma;
  Outcome out;
  out.error << 100.0 * e[kFocal], kDegrees * e.head<3>().norm(), 1e3 * e[kLater], 1e3 * e[kReadout];
  out.sigma << 100.0 * s[kFocal], kDegrees * s.head<3>().norm(), 1e3 * s[kLater], 1e3 * s[kReadout];
  out.turn_nees = e.head<3>().cwiseQuotient(s.head<3>()).squaredNorm() / 3.0;
  return out;
}

struct Score {
  int draws = 0, found = 0, good = 0, aimed = 0;
  Eigen::Array4d squares = Eigen::Array4d::Zero();  ///< of errors over deviations
};

void printDraw(std::uint64_t seed, const Draw& draw, const char* verdict) {
  const CameraCalibration& c = draw.truth();
  fmt::print("{},{},{:.0f},{:.3f},{:.3f},{:.1f},{:.1f},{},{:.0f}/{:.0f}/{:.0f},{}", seed,
             draw.scene.ground == sim::GroundKind::kRoom ? "room" : "street", draw.view_deg,
             c.distortion_coefficients[0], c.distortion_coefficients[1], 1e3 * c.time_offset_s,
             1e3 * c.readout_s, draw.mounting, draw.swing_deg.x(), draw.swing_deg.y(),
             draw.swing_deg.z(), verdict);
}

void runOne(std::uint64_t seed, const Settings& settings, Score& score) {
  const Eigen::Array4d bar(1.0, 0.5, 3.0, 3.0), aim(0.3, 0.2, 1.0, 1.0);
  const Draw draw = drawOf(seed, settings);
  const auto dataset = replay::Dataset::open({.path = recordingOf(draw, seed, settings)});
  const auto found = rigFromMotion(dataset->recording(), {});
  ++score.draws;
  if (!found) {
    printDraw(seed, draw, found.error().code.c_str());
    fmt::print(",\"{}\"\n", found.error().detail);
    return;
  }
  const Outcome out = outcomeOf(found->joint, draw.truth());
  const bool good = (out.error.abs() <= bar).all(), aimed = (out.error.abs() <= aim).all();
  printDraw(seed, draw, aimed ? "aim" : good ? "bar" : "WRONG");
  for (int i = 0; i < 4; ++i) fmt::print(",{:+.3f},{:.3f}", out.error[i], out.sigma[i]);
  fmt::print(",{:.2f},{}\n", found->joint.residual_px, found->joint.windows);
  ++score.found, score.good += good, score.aimed += aimed;
  Eigen::Array4d z = (out.error / out.sigma).square();
  z[1] = out.turn_nees;
  score.squares += z;
}

int runAll(const Settings& settings) {
  Score score;
  fmt::print(
      "seed,scene,view_deg,k1,k2,offset_ms,readout_ms,mounting,swing_deg,verdict,focal_percent,"
      "sigma,rotation_deg,sigma,offset_ms,sigma,readout_ms,sigma,residual_px,stretches\n");
  for (std::uint64_t seed = settings.first; seed <= settings.last; seed += settings.step) {
    runOne(seed, settings, score);
    std::fflush(stdout);
  }
  const Eigen::Array4d nees = score.squares / std::max(1, score.found);
  fmt::print(
      "# {} draws: {} within 1 %, 0.5°, 3 ms, 3 ms ({} within 0.3 %, 0.2°, 1 ms, 1 ms), {} "
      "refused, {} wrong; mean squared error over variance: focal length {:.2f}, rotation {:.2f}, "
      "offset {:.2f}, readout {:.2f}\n",
      score.draws, score.good, score.aimed, score.draws - score.found, score.found - score.good,
      nees[0], nees[1], nees[2], nees[3]);
  return score.found == score.good ? 0 : 1;
}

}  // namespace
}  // namespace perdure::calibrate

int main(int argc, char** argv) {
  CLI::App app("How exact perdure calibrate from-motion is on simulated recordings");
  perdure::calibrate::Settings settings;
  app.add_option("--first", settings.first, "seed of the first draw")->capture_default_str();
  app.add_option("--last", settings.last, "seed of the last draw")->capture_default_str();
  app.add_option("--step", settings.step, "2: every second seed")->capture_default_str();
  app.add_option("--seconds", settings.seconds)->capture_default_str();
  app.add_flag("--car", settings.car, "a car in a street, which turns about one axis");
  app.add_option("--cache", settings.cache, "folder of the recordings")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return perdure::calibrate::runAll(settings);
}
