#include "tools/calibrate/simulated.h"

#include <cmath>

#include "common/camera/camera_model.h"
#include "common/math/so3.h"
#include "common/sim/dice.h"
#include "common/sim/imu.h"
#include "common/sim/scenes/parts/rigs.h"
#include "tools/simulate/writer.h"

namespace perdure::calibrate {
namespace {

constexpr double kInterval = 0.04;  ///< s, interval of the motion's control points

Eigen::Vector3d normal3(sim::Dice& dice) { return {dice.normal(), dice.normal(), dice.normal()}; }

/// Changes a lens and its pose, so that they differ from the data sheet.
void perturb(CameraCalibration& camera, sim::Dice& dice) {
  const double focal = 1.0 + 0.03 * dice.normal();
  camera.fx *= focal;
  camera.fy *= focal * (1.0 + 0.003 * dice.normal());
  camera.cx += 6.0 * dice.normal();
  camera.cy += 6.0 * dice.normal();
  for (double& d : camera.distortion_coefficients) d *= 1.0 + 0.2 * dice.normal();
  camera.T_BC.q = camera.T_BC.q * expQuaternion(0.03 * normal3(dice));
  camera.T_BC.p += 0.015 * normal3(dice);
  camera.time_offset_s = dice.uniform(-0.02, 0.02);
}

sim::Rig makeRig(const SimulatedOptions& options, sim::Dice& dice) {
  sim::SceneOptions world;
  world.width = options.width, world.height = options.height;
  world.rate_hz = options.rate_hz;
  world.mono8 = true;
  sim::Rig rig = sim::makeRig(sim::Carrier::kHand, world, dice, 0.0);
  CameraCalibration& camera = rig.calibration.cameras[0];
  if (options.lens == DistortionModel::kEquidistant) {
    camera.fx = camera.fy = 0.36 * options.width;
    camera.distortion_coefficients = {-0.012, 0.006, -0.004, 0.0008};
  }
  camera.distortion = options.lens;
  camera.readout_s = options.readout_s;
  rig.cameras[0].exposure_s = options.exposure_s;
  rig.true_calibration = rig.calibration;
  perturb(rig.true_calibration.cameras[0], dice);
  return rig;
}

/// A sum of a few waves with a total amplitude of 1.
struct Wander {
  struct Wave {
    double amplitude, rate, phase;
  };
  std::vector<Wave> waves;

  Wander(sim::Dice& dice, double low_hz, double high_hz) {
    for (const double amplitude : {0.45, 0.33, 0.22}) {
      waves.push_back(
          {amplitude, 2 * M_PI * dice.uniform(low_hz, high_hz), dice.uniform(0, 2 * M_PI)});
    }
  }
  double at(double t) const {
    double sum = 0.0;
    for (const Wave& w : waves) sum += w.amplitude * std::sin(w.rate * t + w.phase);
    return sum;
  }
};

struct Wander3 {
  Wander x, y, z;
  Wander3(sim::Dice& dice, double low_hz, double high_hz)
      : x(dice, low_hz, high_hz), y(dice, low_hz, high_hz), z(dice, low_hz, high_hz) {}
  Eigen::Vector3d at(double t) const { return {x.at(t), y.at(t), z.at(t)}; }
};

/// The camera moves in front of the board; after a third of the time it also shakes and rotates.
sim::Trajectory handMotion(const SimulatedCalibration& simulated, sim::Dice& dice) {
  const SimulatedOptions& options = simulated.options;
  const CameraCalibration& camera = simulated.truth();
  const Eigen::Vector2d from = options.board.printFrom(), to = options.board.printTo();
  const Eigen::Vector2d middle = 0.5 * (from + to), size = to - from;
  const double fill = options.board.kind == BoardKind::kChessboard ? 0.42 : 0.6;
  const double distance = std::max(size.x() * camera.fx / (fill * camera.width),
                                   size.y() * camera.fy / (fill * camera.height));
  const Wander3 place(dice, 0.06, 0.16), look(dice, 0.05, 0.14), shift(dice, 0.7, 1.5),
      turn(dice, 0.5, 1.2);
  std::vector<RigidTransform> controls;
  for (int i = 0; kInterval * i <= options.seconds + 4 * kInterval; ++i) {
    const double t = kInterval * i;
    const double begun = std::clamp(t / options.seconds * 6.0 - 1.5, 0.0, 1.0);
    const double shake = options.shake ? begun * begun * (3 - 2 * begun) : 0.0;
    const Eigen::Vector3d p = place.at(t);
    const Eigen::Vector3d p_TC(middle.x() + 1.0 * distance * p.x(),
                               middle.y() + 0.8 * distance * p.y(),
                               -distance * (1.05 + 0.35 * p.z()));
    // The camera first faces the middle of the board: x right, y down, z forward.
    const Eigen::Vector3d z = (Eigen::Vector3d(middle.x(), middle.y(), 0.0) - p_TC).normalized();
    Eigen::Matrix3d R_TC;
    R_TC.col(0) = Eigen::Vector3d::UnitY().cross(z).normalized();
    R_TC.col(1) = z.cross(R_TC.col(0));
    R_TC.col(2) = z;
    const Eigen::Vector3d past = look.at(t).cwiseProduct(Eigen::Vector3d(0.3, 0.4, 0.6));
    const Eigen::Vector3d turned = shake * turn.at(t).cwiseProduct(Eigen::Vector3d(.3, .3, .45));
    const RigidTransform T_TC(R_TC * expSo3(past) * expSo3(turned),
                              p_TC + 0.12 * shake * shift.at(t));
    controls.push_back(simulated.T_WT * T_TC * camera.T_BC.inverse());
  }
  return sim::Trajectory(0.0, kInterval, std::move(controls));
}

}  // namespace

std::vector<TimePoint> SimulatedCalibration::stamps() const {
  // The motion starts at time 0, so that each stamp plus the time offset is within the motion.
  std::vector<TimePoint> all;
  const auto count = static_cast<int>(options.seconds * options.rate_hz);
  for (int i = 1; i + 1 < count; ++i) {
    all.push_back(tools::kSceneEpoch + durationFromSeconds(i / options.rate_hz));
  }
  return all;
}

RigidTransform SimulatedCalibration::T_CT(double t_s) const {
  return (scene.body.poseAt(t_s) * truth().T_BC).inverse() * T_WT;
}

SimulatedCalibration simulateCalibration(const SimulatedOptions& options) {
  SimulatedCalibration simulated{options, {}, {}};
  sim::Dice dice(sim::seedOf("calibration", {options.seed}));
  sim::Scene& scene = simulated.scene;
  scene.name = "calibration";
  scene.proves = "what a calibration finds";
  scene.seed = options.seed;
  scene.seconds = options.seconds;
  scene.ground = sim::GroundKind::kRoom;
  scene.rig = makeRig(options, dice);
  Eigen::Matrix3d R_WT;  // upright on a wall across W's x axis
  R_WT << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  simulated.T_WT = RigidTransform(Eigen::Matrix3d(R_WT * expSo3(0.08 * normal3(dice))),
                                  Eigen::Vector3d(2.0, 0.3, 1.4));
  scene.body = handMotion(simulated, dice);
  return simulated;
}

std::vector<View> simulateViews(const SimulatedCalibration& simulated, double sigma_px) {
  const CameraModel camera(simulated.truth());
  const Board& board = simulated.options.board;
  sim::Dice dice(sim::seedOf("corners", {simulated.options.seed}));
  std::vector<View> views;
  std::uint64_t frame = 0;
  for (const TimePoint stamp : simulated.stamps()) {
    const double middle = toSeconds(stamp - tools::kSceneEpoch) + simulated.truth().time_offset_s;
    View view{frame++, stamp, {}};
    for (std::size_t id = 0; id < board.cornerCount(); ++id) {
      auto pixel = camera.project(simulated.T_CT(middle) * board.corner(id));
      // Each row of a rolling shutter is exposed at its own time.
      for (int i = 0; i < 4 && pixel && simulated.truth().readout_s > 0.0; ++i) {
        const double row = pixel->y() / (camera.height() - 1) - 0.5;
        const double t = middle + simulated.truth().readout_s * row;
        pixel = camera.project(simulated.T_CT(t) * board.corner(id));
      }
      const Eigen::Vector2d noise(dice.normal(), dice.normal());
      if (pixel && camera.inImage(*pixel, 8.0)) {
        view.corners.push_back({id, *pixel + sigma_px * noise});
      }
    }
    const bool whole = view.corners.size() == board.cornerCount();
    if (board.kind == BoardKind::kChessboard && !whole) view.corners.clear();
    if (!view.corners.empty()) views.push_back(std::move(view));
  }
  return views;
}

std::vector<ImuSample> simulateSamples(const SimulatedCalibration& simulated) {
  const sim::Scene& scene = simulated.scene;
  std::vector<ImuSample> samples;
  for (const auto& record :
       sim::simulateImu(scene.body, *scene.rig.true_calibration.imu, scene.rig.imu, scene.seed,
                        scene.seconds, tools::kSceneEpoch)) {
    samples.push_back(record.sample);
  }
  return samples;
}

}  // namespace perdure::calibrate
