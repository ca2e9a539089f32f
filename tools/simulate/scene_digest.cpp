#include "tools/simulate/scene_digest.h"

#include <bit>
#include <string>

#include "tools/simulate/render/counter_noise.h"

namespace perdure::tools {
namespace {

class Digest {
 public:
  void add(std::uint64_t bits) { value_ = mixBits(value_, bits); }
  void add(double number) { add(std::bit_cast<std::uint64_t>(number)); }
  void add(const std::string& text) {
    for (const char c : text) add(static_cast<std::uint64_t>(static_cast<unsigned char>(c)));
    add(static_cast<std::uint64_t>(text.size()));
  }
  template <class Derived>
  void add(const Eigen::MatrixBase<Derived>& numbers) {
    for (Eigen::Index i = 0; i < numbers.size(); ++i) add(static_cast<double>(numbers(i)));
  }
  void add(const RigidTransform& T) {
    add(T.q.coeffs());
    add(T.p);
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0;
};

void addCamera(Digest& digest, const CameraCalibration& camera) {
  for (const double number : {camera.fx, camera.fy, camera.cx, camera.cy, camera.time_offset_s,
                              camera.readout_s, camera.rate_hz}) {
    digest.add(number);
  }
  for (const double number : camera.distortion_coefficients) digest.add(number);
  digest.add(camera.T_BC);
}

void addRig(Digest& digest, const sim::Rig& rig) {
  for (const auto& camera : rig.calibration.cameras) addCamera(digest, camera);
  for (const auto& camera : rig.true_calibration.cameras) addCamera(digest, camera);
  for (const auto& e : rig.cameras) {
    for (const double number :
         {e.exposure_s, e.noise_electrons, e.full_well_electrons, e.vignetting, e.gain_walk}) {
      digest.add(number);
    }
  }
  digest.add(rig.imu.gyro_bias);
  digest.add(rig.imu.accel_bias);
  digest.add(rig.imu.gyro_scale);
  digest.add(rig.imu.accel_scale);
}

void addObject(Digest& digest, const sim::SceneObject& object, double seconds) {
  digest.add(object.id);
  digest.add(object.class_name);
  digest.add(object.shape);
  digest.add(object.look_seed);
  digest.add(object.size);
  digest.add(object.present_from_s);
  digest.add(object.present_until_s);
  for (double t = 0.0; t <= (object.moves ? seconds : 0.0); t += 1.0) {
    digest.add(object.motion.poseAt(t));
  }
}

}  // namespace

std::uint64_t digestOf(const sim::Scene& scene) {
  Digest digest;
  for (const auto& object : scene.objects) addObject(digest, object, scene.seconds);
  for (const auto& prop : scene.props) {
    digest.add(static_cast<std::uint64_t>(prop.kind));
    digest.add(prop.look_seed);
    digest.add(prop.size);
    digest.add(prop.T_WP);
  }
  for (const auto& road : scene.roads) {
    digest.add(road.from);
    digest.add(road.to);
    digest.add(road.width_m);
  }
  digest.add(scene.sun_W);
  digest.add(scene.sun_strength);
  digest.add(scene.sky_strength);
  for (double t = 0.0; t <= scene.seconds; t += 1.0) digest.add(scene.body.poseAt(t));
  addRig(digest, scene.rig);
  return digest.value();
}

}  // namespace perdure::tools
