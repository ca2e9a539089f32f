#include "tests/bench/vio_suite/clips.h"

#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

#include "common/replay/files/pose_file.h"
#include "common/sim/imu.h"
#include "tests/bench/vio_suite/worlds.h"
#include "tools/simulate/simulate.h"

namespace perdure::bench {
namespace {

namespace fs = std::filesystem;

constexpr char kWhole[] = "unpacked";  ///< a file that marks a folder as complete

std::vector<std::string> imageNames(const fs::path& list) {
  std::ifstream file(list);
  std::vector<std::string> names;
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::string name = line.substr(line.find(',') + 1);
    while (!name.empty() && (name.back() == '\r' || name.back() == ' ')) name.pop_back();
    names.push_back(name);
  }
  return names;
}

/// Extracts the frames of the video as images with the names of the folder's list.
void unpack(const fs::path& from, const fs::path& to, const std::function<void(double)>& progress) {
  fs::create_directories(to);
  constexpr auto kOver = fs::copy_options::recursive | fs::copy_options::overwrite_existing;
  fs::copy(from / "mav0", to / "mav0", kOver);
  fs::copy(from / "gt_tum.txt", to / "gt_tum.txt", kOver);
  const fs::path images = to / "mav0" / "cam0" / "data";
  fs::create_directories(images);
  cv::VideoCapture video((from / "cam0.mkv").string());
  const auto names = imageNames(to / "mav0" / "cam0" / "data.csv");
  cv::Mat image, grey;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (!video.read(image)) {
      throw std::runtime_error((from / "cam0.mkv").string() + " ends after " + std::to_string(i) +
                               " of " + std::to_string(names.size()) +
                               " frames; fetch it again, and install libopencv-videoio-dev with "
                               "FFmpeg where no video opens at all");
    }
    cv::extractChannel(image, grey, 0);
    cv::imwrite((images / names[i]).string(), grey, {cv::IMWRITE_PNG_COMPRESSION, 1});
    progress(static_cast<double>(i + 1) / static_cast<double>(names.size()));
  }
}

/// Writes samples simulated along the truth, with the errors of EuRoC's unit.
void writeFittingImu(const fs::path& folder, unsigned seed) {
  const replay::PoseFile truth = replay::PoseFile::read(folder / "gt_tum.txt");
  const auto& poses = truth.poses();
  const double step =
      toSeconds(poses.back().time - poses.front().time) / static_cast<double>(poses.size() - 1);
  std::vector<RigidTransform> controls;
  for (const auto& pose : poses) controls.push_back(pose.T_WB);
  const sim::Trajectory body(0.0, step, std::move(controls));
  const ImuCalibration densities{1.7e-4, 2e-5, 2e-3, 3e-3, 1.0 / step};
  sim::ImuErrors errors;
  errors.gyro_bias = {-0.002, 0.02, 0.08};
  errors.accel_bias = {-0.02, 0.1, 0.05};
  const auto samples = sim::simulateImu(
      body, densities, errors, seed, step * static_cast<double>(poses.size()), poses.front().time);
  std::ofstream file(folder / "mav0" / "imu0" / "data.csv");
  file << "#timestamp [ns],w_RS_S_x,w_RS_S_y,w_RS_S_z,a_RS_S_x,a_RS_S_y,a_RS_S_z\n";
  file.precision(12);
  for (const auto& [sample, gyro_bias, accel_bias] : samples) {
    file << toNanoseconds(sample.time);
    for (int i = 0; i < 3; ++i) file << ',' << sample.gyro[i];
    for (int i = 0; i < 3; ++i) file << ',' << sample.accel[i];
    file << '\n';
  }
}

}  // namespace

std::vector<Clip> allClips(const fs::path& data) {
  const fs::path euroc = data / "euroc_semi";
  constexpr Half T = Half::kTuned, J = Half::kJudged;
  return {
      {"V102", J, "a room, real motion and IMU", euroc / "V102"},
      {"V103", T, "a room, fast, real motion and IMU", euroc / "V103"},
      {"V201", J, "another room, real motion and IMU", euroc / "V201"},
      {"V102_fit", T, "V102 with an IMU that agrees with the images", euroc / "V102", true},
      {"V201_fit", J, "V201 with an IMU that agrees with the images", euroc / "V201", true},
      {"room_walk", T, "a small room, a slow walk", {}, false, roomWalk},
      {"room_fly", J, "a small room, flown", {}, false, roomFly},
      {"hall_fly", T, "a hall, flown fast", {}, false, hallFly},
      {"hall_even", J, "a hall, flown slowly and evenly", {}, false, hallEven},
      {"shaky", J, "a room, fast and shaken at 4 to 9 Hz", {}, false, shaky},
      {"turn", J, "a room; turning in place for a minute", {}, false, turn},
      {"pan", T, "a room; a slow turn at arm's length, IMU of a phone", {}, false, pan},
      {"dim", T, "a room, dim: long exposures and much noise", {}, false, dim},
      {"plain", J, "a room with walls and little else", {}, false, plain},
      {"street", T, "a street, driven, without wheel speed", {}, false, street},
      {"far", J, "over a town: points are 30 to 200 m away", {}, false, far},
      {"coarse_imu", T, "a hall; IMU of a phone", {}, false, coarseImu},
      {"fine_imu", J, "a hall; tactical IMU", {}, false, fineImu},
      {"rolling", T, "a room, flown; rows are exposed in turn, 20 ms", {}, false, rolling, true},
      {"rolling_global", T, "the same with all rows at once", {}, false, rolling},
  };
}

std::optional<fs::path> prepare(const Clip& clip, const fs::path& cache, unsigned draw,
                                const std::function<void(double)>& progress) {
  const fs::path folder =
      cache /
      (draw == 0 || !clip.real.empty() ? clip.name : clip.name + "_" + std::to_string(draw));
  if (!clip.real.empty()) {
    if (fs::exists(folder / kWhole)) return folder;
    if (!fs::exists(clip.real / "cam0.mkv")) return std::nullopt;
    unpack(clip.real, folder, progress);
    if (clip.imu_fits) writeFittingImu(folder, 7);
    std::ofstream(folder / kWhole) << clip.what << '\n';
    return folder;
  }
  tools::SimulateOptions options;
  options.out = folder;
  options.world.mono8 = true;
  options.world.rolling_shutter = clip.rolling_shutter;
  options.threads = 1;
  tools::simulate(clip.make(options.world, draw), options, [&](const tools::SimulateProgress& p) {
    progress(static_cast<double>(p.frame) / static_cast<double>(p.frames));
  });
  return folder;
}

}  // namespace perdure::bench
