// A real room with a real network, compared with its depth images (red_kitchen.csv).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <vector>

#include "common/replay/files/text_file.h"
#include "tests/common/replay/tiny_datasets.h"
#include "tools/pipeline/pipeline.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

struct RoomThing {
  std::string name, class_name, known;
  Eigen::Vector3d centre, size;
  double yaw = 0.0;
  bool judged = false;

  /// Returns 0 within the cuboid.
  double distanceTo(const Eigen::Vector3d& point) const {
    const Eigen::Vector3d in_thing =
        Eigen::AngleAxisd(-yaw, Eigen::Vector3d::UnitZ()) * (point - centre);
    return (in_thing.cwiseAbs() - size / 2.0).cwiseMax(0.0).norm();
  }
};

fs::path sourceFolder() { return std::getenv("PERDURE_SOURCE"); }

std::vector<RoomThing> readRoom() {
  std::vector<RoomThing> things;
  for (const auto& line : replay::readLines(sourceFolder() / "tests/tools/pipeline/red_kitchen.csv",
                                            "it stands beside the test")) {
    if (line.text.starts_with('#') || line.text.starts_with("name,")) continue;
    const auto fields = replay::split(line.text, ',');
    const auto v = replay::parseNumbers({fields.begin() + 2, fields.begin() + 10});
    if (fields.size() != 11 || !v) throw std::runtime_error("red_kitchen.csv: " + line.text);
    RoomThing thing;
    thing.name = fields[0], thing.class_name = fields[1], thing.known = fields[10];
    thing.centre = {(*v)[0], (*v)[1], (*v)[2]}, thing.size = {(*v)[3], (*v)[4], (*v)[5]};
    thing.yaw = (*v)[6] * M_PI / 180.0, thing.judged = (*v)[7] != 0.0;
    things.push_back(thing);
  }
  return things;
}

class RealRoom : public ::testing::Test {
 protected:
  static constexpr double kNear_m = 0.3;

  void SetUp() override {
    if (!fs::is_directory(scene()) || !fs::exists(network())) {
      GTEST_SKIP() << scene() << " or " << network() << " is absent: the real room is not run";
    }
    run();
  }
  static fs::path scene() { return sourceFolder() / "../shared/data/scenes7_redkitchen"; }
  static fs::path network() {
    return sourceFolder() / "../shared/data/weights/yolox_nano_416.onnx";
  }

  /// Every third frame: 10 Hz.
  static fs::path thinned() {
    const fs::path folder = replay::freshFolder("red_kitchen");
    fs::create_directories(folder / "color");
    for (const char* part : {"pose", "depth"}) {
      fs::create_directory_symlink(fs::canonical(scene() / part), folder / part);
    }
    for (int i = 0; i < 1000; i += 3) {
      char name[24];
      std::snprintf(name, sizeof name, "%06d.jpg", i);
      fs::create_symlink(fs::canonical(scene() / "color" / name), folder / "color" / name);
    }
    return folder;
  }

  /// Runs once for all tests.
  static void run() {
    static const std::vector<ObjectBelief> once = [] {
      PipelineOptions options;
      options.data = thinned().string();
      options.odometry = "truth", options.detections = "model";
      options.model = network().string();
      options.assignments = {"inference.detection.classes=[chair, dining table, tv, cup]"};
      options.out = replay::freshFolder("red_kitchen_out").string();
      Pipeline pipeline(options);
      pipeline.run([](const PipelineCounts&) {});
      pipeline.finish();
      return pipeline.outputs().history().lastBeliefs();
    }();
    objects_ = once;
  }

  static Eigen::Vector3d placeOf(const ObjectBelief& object) {
    return object.best().mean.head<3>();
  }
  static std::size_t foundAs(const RoomThing& thing) {
    return static_cast<std::size_t>(
        std::count_if(objects_.begin(), objects_.end(), [&](const ObjectBelief& object) {
          return object.best().name == thing.class_name &&
                 (placeOf(object) - thing.centre).head<2>().norm() < kNear_m;
        }));
  }
  static std::string list() {
    std::string text;
    for (const auto& object : objects_) {
      const Eigen::Vector3d p = placeOf(object);
      char line[120];
      std::snprintf(line, sizeof line, "%s at (%.2f, %.2f, %.2f)\n", object.best().name.c_str(),
                    p.x(), p.y(), p.z());
      text += line;
    }
    return text;
  }

  static inline std::vector<ObjectBelief> objects_;
};

TEST_F(RealRoom, WhatStandsThereIsOneObjectOfItsClassButForKnownFailures) {
  std::size_t judged = 0;
  for (const auto& thing : readRoom()) {
    if (!thing.judged) continue;
    ++judged;
    const bool found = foundAs(thing) == 1;
    EXPECT_EQ(found, thing.known.empty())
        << thing.name << (found ? " is found: empty its `known` in red_kitchen.csv" : " is missing")
        << "\non the map:\n"
        << list();
  }
  EXPECT_EQ(judged, 11U);
}

// Known failure: the bar allows no ghost. A quarter of a degree in the vertical of the poses' frame
// decides whether a "chair" appears on the floor at (-2.10, 2.94).
TEST_F(RealRoom, NothingIsTwiceAndAtMostOneThingIsWhereNothingStands) {
  constexpr std::size_t kKnownGhosts = 1;
  const auto things = readRoom();
  std::map<std::string, std::size_t> objects_of;
  std::size_t ghosts = 0;
  ASSERT_FALSE(objects_.empty());
  for (const auto& object : objects_) {
    const auto distance = [&](const RoomThing& t) {
      return t.distanceTo(placeOf(object)) + 1e-3 * (t.centre - placeOf(object)).norm();
    };
    const auto nearest =
        std::min_element(things.begin(), things.end(),
                         [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
    const bool stands = nearest->distanceTo(placeOf(object)) < kNear_m;
    ++(stands ? objects_of[nearest->name] : ghosts);
  }
  EXPECT_LE(ghosts, kKnownGhosts) << "on the map:\n" << list();
  for (const auto& [name, count] : objects_of) EXPECT_EQ(count, 1U) << name << '\n' << list();
}

}  // namespace
}  // namespace perdure::tools
