#include "tests/golden/runs.h"

#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <ostream>
#include <stdexcept>

#include "tests/process/support.h"
#include "tests/scenario/scene_cache.h"

namespace perdure::test {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

constexpr int kVideoFrames = 300;  ///< 15 s at 20 Hz

void perdure(const Words& arguments, const fs::path& log) {
  Words command{(programs() / "perdure").string()};
  command.insert(command.end(), arguments.begin(), arguments.end());
  Child child(command, log.string());
  const int status = child.wait(std::chrono::minutes(20));
  if (status == 0) return;
  std::string text = "exit status " + std::to_string(status) + " of:";
  for (const auto& word : command) text += " " + word;
  throw std::runtime_error(text + "\n" + child.log());
}

/// Extracts the folder's first frames as images, and copies its other files.
void unpack(const fs::path& from, const fs::path& to) {
  fs::create_directories(to / "mav0/cam0/data");
  fs::copy(from / "mav0/imu0", to / "mav0/imu0");
  fs::copy_file(from / "mav0/cam0/sensor.yaml", to / "mav0/cam0/sensor.yaml");
  std::ifstream list(from / "mav0/cam0/data.csv");
  std::ofstream shorter(to / "mav0/cam0/data.csv");
  cv::VideoCapture video((from / "cam0.mkv").string());
  cv::Mat image;
  int frames = 0;
  for (std::string line; frames < kVideoFrames && std::getline(list, line);) {
    shorter << line << '\n';
    if (line.starts_with('#')) continue;
    if (!video.read(image)) throw std::runtime_error("the video ends too early");
    std::vector<cv::Mat> channels;
    cv::split(image, channels);
    const std::string name = line.substr(0, line.find(',')) + ".png";
    cv::imwrite((to / "mav0/cam0/data" / name).string(), channels[0],
                {cv::IMWRITE_PNG_COMPRESSION, 1});
    ++frames;
  }
  if (frames < kVideoFrames) throw std::runtime_error("the list of frames ends too early");
}

fs::path sceneOf(const GoldenRun& run, const fs::path& folder) {
  return cachedScene({.scene = run.name}, [&](const fs::path& scene) {
    perdure({"simulate", "--scene", run.name, "--seed", "1", "--rate", "10", "--no-images",
             "--encoding", "jpeg", "--quiet", "--out", scene.string()},
            folder / "simulate.log");
  });
}

/// Returns the arguments of `perdure pipeline`, without --out.
Words inputOf(const GoldenRun& run, const fs::path& folder) {
  if (run.data.empty()) {
    return {"--data",       sceneOf(run, folder).string(),
            "--odometry",   "truth",
            "--detections", "simulated",
            "--seed",       "1"};
  }
  const fs::path data = test::data(run.data);
  if (run.pictures) {
    return {"--data", (folder / "drive").string(), "--odometry", "vio", "--detections", "none"};
  }
  const std::string sequence = run.name.substr(run.name.find('_') + 1);
  return {"--data",       data.string(),
          "--sequence",   sequence,
          "--odometry",   (data / "poses_orb" / (sequence + ".txt")).string(),
          "--detections", (data / "det_rrc/Car" / (sequence + ".txt")).string(),
          "--class",      "Car",
          "--box-origin", "1"};
}

}  // namespace

void PrintTo(const GoldenRun& run, std::ostream* out) { *out << run.name; }

const std::vector<GoldenRun>& goldenRuns() {
  static const std::vector<GoldenRun> runs{{"toy"},
                                           {"still"},
                                           {"occlusion"},
                                           {"vanish"},
                                           {"room"},
                                           {"row"},
                                           {"roll"},
                                           {"traffic"},
                                           {"street"},
                                           {"kitti_0001", "kitti_tracking"},
                                           {"kitti_0019", "kitti_tracking"},
                                           {"euroc_V102", "euroc_semi/V102", true}};
  return runs;
}

const std::vector<std::string>& goldenFiles() {
  static const std::vector<std::string> files{"objects_inst.csv", "objects_final.csv",
                                              "objects.json", "events.jsonl", "trajectory.tum"};
  return files;
}

void produce(const GoldenRun& run, const fs::path& folder) {
  for (const char* part : {"drive", "now"}) fs::remove_all(folder / part);
  fs::create_directories(folder / "now");
  if (run.pictures) unpack(test::data(run.data), folder / "drive");
  Words arguments{"pipeline", "--quiet", "--out", (folder / "now").string()};
  const Words input = inputOf(run, folder);
  arguments.insert(arguments.end(), input.begin(), input.end());
  perdure(arguments, folder / "pipeline.log");
  fs::remove_all(folder / "drive");
}

}  // namespace perdure::test
