#include "tests/bench/vio_suite/worlds.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "common/math/so3.h"

namespace perdure::bench {
namespace {

using Eigen::Vector3d;

/// A flight on an ellipse about the origin. It begins at rest, the gaze varies, and the body may
/// shake.
struct Flight {
  double seconds = 30.0, rest_s = 1.0;
  Vector3d radii{2.2, 1.6, 0.35};
  double height = 1.5;
  double lap_s = 16.0;
  double gaze = 0.9, gaze_s = 7.0;  ///< amplitude of the yaw relative to the direction of travel,
                                    ///< rad
  double side = 0.0;                ///< mean of that yaw, rad
  double nod = 0.12, lean = 0.12;   ///< pitch and roll, rad
  double shake_m = 0.0, shake_rad = 0.0;
};

double begun(double t, double rest_s) {
  const double x = std::clamp((t - rest_s) / 2.0, 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

sim::Trajectory flown(const Flight& f) {
  constexpr double kStep = 0.02;
  std::vector<RigidTransform> poses;
  double phase = 0.0;
  for (double t = 0.0; t < f.seconds + 1.0; t += kStep) {
    const double on = begun(t, f.rest_s);
    phase += on * 2.0 * M_PI / f.lap_s * kStep;
    const auto wave = [&](double hertz, double shift) {
      return std::sin(2.0 * M_PI * hertz * t + shift);
    };
    const Vector3d shake(wave(4.1, 0.3) + 0.6 * wave(7.3, 1.1), wave(5.3, 2.0) + 0.5 * wave(8.9, 0),
                         wave(6.1, 1.7) + 0.5 * wave(9.1, 0.4));
    const Vector3d turn(wave(4.7, 1.0) + 0.5 * wave(8.3, 0.2),
                        wave(5.9, 0.1) + 0.5 * wave(7.7, 2.2),
                        wave(4.3, 2.5) + 0.4 * wave(6.7, 1.3));
    const Vector3d place(f.radii.x() * std::cos(phase), f.radii.y() * std::sin(phase),
                         f.height + f.radii.z() * std::sin(1.7 * phase));
    const double way = std::atan2(f.radii.y() * std::cos(phase), -f.radii.x() * std::sin(phase));
    const double yaw = way + f.side + f.gaze * on * std::sin(2.0 * M_PI * t / f.gaze_s);
    const Eigen::Quaterniond q = expQuaternion({0, 0, yaw}) *
                                 expQuaternion({0, on * f.nod * wave(0.37, 0.5), 0}) *
                                 expQuaternion({on * f.lean * wave(0.29, 1.5), 0, 0}) *
                                 expQuaternion(on * f.shake_rad * turn);
    poses.emplace_back(q, Vector3d(place + on * f.shake_m * shake));
  }
  return sim::Trajectory(0.0, kStep, std::move(poses));
}

/// Errors of an inertial unit: noise densities, and standard deviations of scale, misalignment and
/// biases.
struct Grade {
  ImuCalibration densities{1.7e-4, 2e-5, 2e-3, 3e-3, 200.0};
  double scale = 0.002, misaligned = 0.001, gyro_bias = 0.004, accel_bias = 0.03;
};
constexpr double kPhoneScale = 0.01, kPhoneMisaligned = 0.005;
const Grade kPhone{{1.0e-3, 1.0e-4, 1.0e-2, 5e-3, 200.0}, kPhoneScale, kPhoneMisaligned, 0.01, 0.1};
const Grade kTactical{{2.0e-5, 2e-6, 3e-4, 3e-4, 400.0}, 2e-4, 1e-4, 5e-4, 0.005};

void setImu(sim::Scene& scene, const Grade& grade, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const auto errors = [&] {
    Eigen::Matrix3d M = Eigen::Matrix3d::Identity();
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c)
        M(r, c) += (r == c ? grade.scale : grade.misaligned) * normal(random);
    }
    return M;
  };
  const auto three = [&](double sigma) {
    const double x = normal(random), y = normal(random), z = normal(random);
    return Vector3d(sigma * Vector3d(x, y, z));
  };
  scene.rig.calibration.imu = scene.rig.true_calibration.imu = grade.densities;
  scene.rig.imu.gyro_scale = errors();
  scene.rig.imu.accel_scale = errors();
  scene.rig.imu.gyro_bias = three(grade.gyro_bias);
  scene.rig.imu.accel_bias = three(grade.accel_bias);
}

void withoutSpeed(sim::Scene& scene) {
  scene.rig.speed.reset();
  scene.rig.calibration.has_speed = scene.rig.true_calibration.has_speed = false;
}

/// The seeds of the clips are consecutive; those of the draws are further apart.
unsigned seedOf(unsigned clip, unsigned draw) { return clip + 100 * draw; }

/// Multiplies all dimensions of the scene by `factor`.
void enlarge(sim::Scene& scene, double factor) {
  for (sim::Prop& prop : scene.props) {
    prop.size *= factor;
    prop.T_WP.p *= factor;
  }
  for (sim::SceneObject& object : scene.objects) {
    RigidTransform T = object.motion.poseAt(0.0);
    T.p *= factor;
    object.motion = sim::Trajectory(T);
    object.size *= factor;
  }
}

sim::Scene inRoom(const std::string& name, unsigned seed, const sim::SceneOptions& options,
                  double size, const Flight& flight, const Grade& grade = {}) {
  sim::Scene scene = sim::makeScene("room", seed, options);
  scene.name = "suite_" + name;
  enlarge(scene, size);
  scene.seconds = flight.seconds;
  scene.body = flown(flight);
  setImu(scene, grade, seed);
  return scene;
}

Flight inHall() {
  Flight f;
  f.radii = {6.0, 4.4, 1.2};
  f.height = 4.2;
  f.lap_s = 14.0;
  f.gaze_s = 5.0;
  return f;
}

}  // namespace

sim::Scene roomWalk(const sim::SceneOptions& options, unsigned draw) {
  sim::SceneOptions with = options;
  with.seconds = 30.0;
  sim::Scene scene = sim::makeScene("room", seedOf(21, draw), with);
  scene.name = "suite_room_walk";
  setImu(scene, {}, seedOf(21, draw));
  return scene;
}

sim::Scene roomFly(const sim::SceneOptions& options, unsigned draw) {
  Flight f;
  f.lap_s = 9.0;
  return inRoom("room_fly", seedOf(22, draw), options, 1.0, f);
}

sim::Scene hallFly(const sim::SceneOptions& options, unsigned draw) {
  return inRoom("hall_fly", seedOf(23, draw), options, 2.6, inHall());
}

sim::Scene hallEven(const sim::SceneOptions& options, unsigned draw) {
  Flight f = inHall();
  f.lap_s = 40.0;
  f.gaze_s = 15.0;
  f.gaze = 0.5;
  return inRoom("hall_even", seedOf(24, draw), options, 2.6, f);
}

sim::Scene shaky(const sim::SceneOptions& options, unsigned draw) {
  Flight f;
  f.lap_s = 7.0;
  f.gaze_s = 4.0;
  f.shake_m = 0.006;
  f.shake_rad = 0.02;
  return inRoom("shaky", seedOf(25, draw), options, 1.0, f);
}

sim::Scene turn(const sim::SceneOptions& options, unsigned draw) {
  Flight f;
  f.seconds = 60.0;
  f.radii = {1e-9, 1e-9, 0.0};  // the direction of the gaze needs a path
  f.lap_s = 12.0;
  return inRoom("turn", seedOf(33, draw), options, 1.0, f);
}

sim::Scene pan(const sim::SceneOptions& options, unsigned draw) {
  Flight f;
  f.radii = {0.3, 0.3, 0.02};
  f.lap_s = 60.0;
  f.gaze = 0.1;
  f.side = -M_PI / 2;
  f.nod = f.lean = 0.03;
  return inRoom("pan", seedOf(34, draw), options, 1.0, f, kPhone);
}

sim::Scene dim(const sim::SceneOptions& options, unsigned draw) {
  Flight f;
  f.lap_s = 12.0;
  sim::Scene scene = inRoom("dim", seedOf(26, draw), options, 1.0, f);
  for (sim::CameraErrors& camera : scene.rig.cameras) {
    camera.exposure_s = 0.02;
    camera.full_well_electrons = 600.0;
  }
  return scene;
}

sim::Scene plain(const sim::SceneOptions& options, unsigned draw) {
  Flight f;
  f.lap_s = 12.0;
  sim::Scene scene = inRoom("plain", seedOf(27, draw), options, 1.0, f);
  // One object in four remains.
  std::size_t kept = 0;
  std::erase_if(scene.objects, [&](const auto&) { return kept++ % 4 != 0; });
  std::erase_if(scene.props, [&](const sim::Prop& prop) {
    return prop.kind == sim::PropKind::kShelf || prop.kind == sim::PropKind::kCrate;
  });
  return scene;
}

sim::Scene street(const sim::SceneOptions& options, unsigned draw) {
  sim::SceneOptions with = options;
  with.seconds = 30.0;
  sim::Scene scene = sim::makeScene("street", seedOf(28, draw), with);
  scene.name = "suite_street";
  withoutSpeed(scene);
  setImu(scene, {}, seedOf(28, draw));
  return scene;
}

sim::Scene far(const sim::SceneOptions& options, unsigned draw) {
  Flight f;
  f.radii = {40.0, 30.0, 3.0};
  f.height = 30.0;
  f.lap_s = 30.0;
  f.gaze = 0.4;
  sim::Scene scene = sim::makeScene("town", seedOf(29, draw), options);
  scene.name = "suite_far";
  scene.seconds = f.seconds;
  scene.body = flown(f);
  withoutSpeed(scene);
  setImu(scene, {}, seedOf(29, draw));
  return scene;
}

sim::Scene coarseImu(const sim::SceneOptions& options, unsigned draw) {
  return inRoom("coarse_imu", seedOf(30, draw), options, 2.6, inHall(), kPhone);
}

sim::Scene fineImu(const sim::SceneOptions& options, unsigned draw) {
  return inRoom("fine_imu", seedOf(31, draw), options, 2.6, inHall(), kTactical);
}

sim::Scene rolling(const sim::SceneOptions& options, unsigned draw) {
  Flight f;
  f.lap_s = 10.0;
  return inRoom("rolling", seedOf(32, draw), options, 1.0, f);
}

}  // namespace perdure::bench
