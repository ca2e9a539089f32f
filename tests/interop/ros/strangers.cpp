#include "tests/interop/ros/strangers.h"

#include <gtest/gtest.h>

namespace perdure::test {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr char kPython[] = "/usr/bin/python3";  // uses Debian's packages

fs::path scriptOf(const std::string& name) { return sources() / "tests/interop/ros" / name; }

}  // namespace

/// Starts npm through `env`, which always exists. If npm is missing, `env` reports that and exits.
Npm::Npm() {
  for (const char* name : {"package.json", "write_mcap.mjs", "read_ros2.mjs"})
    fs::copy_file(scriptOf(name), place_.file(name));
  Child npm({"env", "npm", "install", "--prefix", place_.file(""), "--no-audit", "--no-fund",
             "--ignore-scripts", "--prefer-offline", "--fetch-retries=0", "--fetch-timeout=10000"},
            place_.file("npm.log"));
  if (npm.wait(60s) != 0) why_not_ = "npm or its registry is absent (deploy/install --page): " + npm.log();
}

const Npm& Npm::one() {
  static const Npm npm;
  return npm;
}

std::string Npm::run(std::vector<std::string> command) const {
  const Folder place;
  command[0] = place_.file(command[0]);
  command.insert(command.begin(), "node");
  Child node(command, place.file("log"));
  EXPECT_EQ(node.wait(60s), 0) << node.log();
  return node.log();
}

std::string whyNoRosbag() {
  const Folder place;
  Child python({kPython, "-c", "import rosbag, tf2_msgs, sensor_msgs"}, place.file("log"));
  return python.wait(30s) == 0 ? "" : "python3-rosbag is absent: deploy/install --interop";
}

void writeBag(const fs::path& plan, const fs::path& bag, const std::string& compression) {
  const Folder place;
  Child python(
      {kPython, scriptOf("write_bag.py").string(), plan.string(), bag.string(), compression},
      place.file("log"));
  ASSERT_EQ(python.wait(60s), 0) << python.log();
}

}  // namespace perdure::test
