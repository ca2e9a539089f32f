// A drive through a street gives the same map in every recording format.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <sstream>

#include "tests/common/replay/tiny_datasets.h"
#include "tests/interop/ros/drive_plan.h"
#include "tests/interop/ros/strangers.h"

namespace perdure::test {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using replay::Dataset;

void runPerdure(std::vector<std::string> arguments, const fs::path& log) {
  arguments.insert(arguments.begin(), (programs() / "perdure").string());
  Child perdure(arguments, log.string());
  ASSERT_EQ(perdure.wait(120s), 0) << perdure.log();
}

/// Returns the rows without their first field, which names the drive.
std::string valuesIn(const fs::path& table) {
  std::istringstream lines(contentsOf(table));
  std::string values;
  for (std::string line; std::getline(lines, line);)
    values += line.substr(line.starts_with("street") ? line.find(',') : 0) + ",";
  return values;
}

/// Numbers may differ by the rounding of the calibration's conversion to quaternions.
void expectSameTable(const fs::path& a, const fs::path& b) {
  std::istringstream one(valuesIn(a)), other(valuesIn(b));
  std::string left, right;
  std::size_t fields = 0;
  while (std::getline(one, left, ',') && std::getline(other, right, ',')) {
    ++fields;
    char* end = nullptr;
    const double x = std::strtod(left.c_str(), &end);
    if (end == left.c_str()) {
      ASSERT_EQ(left, right) << a;
    } else {
      ASSERT_NEAR(x, std::strtod(right.c_str(), nullptr), 1e-5) << a << ", field " << fields;
    }
  }
  EXPECT_FALSE(std::getline(other, right, ','));
  EXPECT_GT(fields, 500u);
}

TEST(RosDriveMap, IsTheSameFromAFolderAndFromARecording) {
  const fs::path place = replay::freshFolder("ros_map");
  const fs::path folder = place / "street", plan = place / "plan";
  runPerdure({"simulate", "--scene", "street", "--seconds", "4", "--rate", "10", "--size",
              "320x240", "--quiet", "--out", folder.string()},
             place / "simulate.log");
  fs::remove_all(folder / "mav0" / "speed0");  // ROS has no message for the vehicle's speed
  const auto rig = writeImuRig(*Dataset::open({.path = folder}), place / "rig.yaml");
  std::vector<fs::path> files{folder, place / "street.bag"};
  if (whyNoRosbag().empty()) {
    writeBag(writePlan(*Dataset::open({.path = folder}), plan, {}), files[1], "none");
  } else {
    files[1] = place / "street_0.db3";
    writeDb3(*Dataset::open({.path = folder}), files[1], {});
  }
  for (std::size_t i = 0; i < files.size(); ++i) {
    std::vector<std::string> command{
        "pipeline",   "--data",  files[i].string(),
        "--odometry", "vio",     "--detections",
        "model",      "--model", (sources() / "models/perdure_320x240.onnx").string(),
        "--quiet",    "--out",   (place / std::to_string(i)).string()};
    if (i > 0) command.insert(command.end(), {"--rig", rig.string()});
    runPerdure(command, place / ("pipeline" + std::to_string(i) + ".log"));
    if (i == 0) continue;
    for (const char* name : {"objects_final.csv", "odometry.csv"})
      expectSameTable(place / "0" / name, place / std::to_string(i) / name);
  }
}

}  // namespace
}  // namespace perdure::test
