// Sensor data of the folder, without images: writeSensors of writer.h.
#include <fmt/format.h>

#include <iterator>

#include "common/sim/imu.h"
#include "common/sim/speed.h"
#include "tools/simulate/render/counter_noise.h"
#include "tools/simulate/writer.h"

namespace perdure::tools {
namespace {

std::string joined(const Eigen::Vector3d& v) {
  return fmt::format("{},{},{}", v.x(), v.y(), v.z());
}

std::string imuCsv(const std::vector<sim::ImuRecord>& records) {
  std::string text =
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
      "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";
  for (const auto& record : records) {
    text += fmt::format("{},{},{}\n", toNanoseconds(record.sample.time), joined(record.sample.gyro),
                        joined(record.sample.accel));
  }
  return text;
}

std::string speedCsv(const std::vector<SpeedSample>& samples) {
  std::string text = "#timestamp [ns],speed [m s^-1]\n";
  for (const auto& sample : samples) {
    text += fmt::format("{},{}\n", toNanoseconds(sample.time), sample.speed);
  }
  return text;
}

/// The states at the times of the inertial samples.
std::string statesCsv(const sim::Scene& scene, const std::vector<sim::ImuRecord>& records) {
  std::string text =
      "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],"
      "q_RS_z [],v_RS_R_x [m s^-1],v_RS_R_y [m s^-1],v_RS_R_z [m s^-1],b_w_RS_S_x [rad s^-1],"
      "b_w_RS_S_y [rad s^-1],b_w_RS_S_z [rad s^-1],b_a_RS_S_x [m s^-2],b_a_RS_S_y [m s^-2],"
      "b_a_RS_S_z [m s^-2]\n";
  for (const auto& record : records) {
    const auto state = scene.body.at(toSeconds(record.sample.time - kSceneEpoch));
    const Eigen::Quaterniond& q = state.T_WB.q;
    fmt::format_to(std::back_inserter(text), "{},{},{},{},{},{},{},{},{}\n",
                   toNanoseconds(record.sample.time), joined(state.T_WB.p), q.w(), q.x(), q.y(),
                   q.z(), joined(state.velocity_W), joined(record.gyro_bias),
                   joined(record.accel_bias));
  }
  return text;
}

}  // namespace

void writeSensors(const std::filesystem::path& folder, const sim::Scene& scene) {
  const std::filesystem::path mav0 = folder / "mav0";
  const ImuCalibration imu = scene.rig.calibration.imu.value_or(ImuCalibration{0, 0, 0, 0, 200.0});
  const auto records =
      sim::simulateImu(scene.body, scene.rig.true_calibration.imu.value_or(imu), scene.rig.imu,
                       mixBits(scene.seed, 0x144), scene.seconds, kSceneEpoch);
  writeWhole(mav0 / "imu0" / "sensor.yaml", imuYaml(imu));
  writeWhole(mav0 / "imu0" / "data.csv", imuCsv(records));
  const auto truth = mav0 / "state_groundtruth_estimate0";
  writeWhole(truth / "sensor.yaml", groundTruthYaml());
  writeWhole(truth / "data.csv", statesCsv(scene, records));
  if (scene.rig.speed) {
    const auto samples = sim::simulateSpeed(
        scene.body, *scene.rig.speed, mixBits(scene.seed, 0x59eed), scene.seconds, kSceneEpoch);
    writeWhole(mav0 / "speed0" / "sensor.yaml", speedYaml(*scene.rig.speed));
    writeWhole(mav0 / "speed0" / "data.csv", speedCsv(samples));
  }
  sim::writeObjectsTruth(folder, sim::truthOf(scene, kSceneEpoch));
}

}  // namespace perdure::tools
