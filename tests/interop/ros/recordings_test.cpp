// ROS recordings of foreign programs: rosbag (ROS 1), npm's @mcap/core with
// @foxglove/rosmsg2-serialization (ROS 2).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/replay/dataset.h"
#include "tests/common/replay/tiny_datasets.h"
#include "tests/interop/ros/drive_plan.h"
#include "tests/interop/ros/strangers.h"

namespace perdure::test {
namespace {

namespace fs = std::filesystem;
using replay::Dataset;
using testing::HasSubstr;

void expectTheFolders(const fs::path& folder, const fs::path& file, const fs::path& rig) {
  const auto original = Dataset::open({.path = folder});
  const auto recorded = Dataset::open({.path = file, .rig = rig});
  ASSERT_EQ(recorded->calibration().cameras.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    const auto &a = original->calibration().cameras[i], &b = recorded->calibration().cameras[i];
    EXPECT_EQ(a.distortion_coefficients, b.distortion_coefficients);
    EXPECT_EQ(a.cx, b.cx);
    EXPECT_LT((a.T_BC.matrix() - b.T_BC.matrix()).norm(), 1e-12);
  }
  const Given a = allOf(*original), b = allOf(*recorded);
  EXPECT_EQ(a.pixels.size(), 10u);
  EXPECT_EQ(a.order, b.order);
  EXPECT_EQ(a.pixels, b.pixels);
  EXPECT_TRUE(recorded->reasons().all().empty());
}

struct Tiny {
  explicit Tiny(const std::string& name, const PlanOptions& options = {})
      : folder(replay::tinyEuroc(name, true)), out(replay::freshFolder(name + "_out")) {
    plan = writePlan(*Dataset::open({.path = folder}), out / "plan", options);
    rig = writeImuRig(*Dataset::open({.path = folder}), out / "rig.yaml");
  }
  fs::path folder, out, plan, rig;
};

TEST(RosStrangers, ABagOfRosbagIsTheDriveRawPackedAndCompressed) {
  if (const auto why = whyNoRosbag(); !why.empty()) GTEST_SKIP() << why;
  const Tiny raw("bag_raw"), png("bag_png", {.images = PlanOptions::Images::kPng});
  writeBag(raw.plan, raw.out / "raw.bag", "none");
  expectTheFolders(raw.folder, raw.out / "raw.bag", raw.rig);
  writeBag(raw.plan, raw.out / "packed.bag", "bz2");
  expectTheFolders(raw.folder, raw.out / "packed.bag", raw.rig);
  writeBag(raw.plan, raw.out / "lz4.bag", "lz4");
  expectTheFolders(raw.folder, raw.out / "lz4.bag", raw.rig);
  writeBag(png.plan, png.out / "png.bag", "none");
  expectTheFolders(png.folder, png.out / "png.bag", png.rig);
}

TEST(RosStrangers, ABagThatWasNeverClosedIsReadAsFarAsItGoes) {
  if (const auto why = whyNoRosbag(); !why.empty()) GTEST_SKIP() << why;
  const Tiny tiny("bag_cut");
  const auto bag = tiny.out / "cut.bag";
  writeBag(tiny.plan, bag, "none");
  const auto size = fs::file_size(bag);
  int opened = 0;
  for (std::uintmax_t cut = 1; cut < 24; ++cut) {
    fs::resize_file(bag, size - cut * size / 24);
    const std::string refusal = replay::startupErrorOf([&] {
      const auto dataset = Dataset::open({.path = bag, .rig = tiny.rig});
      EXPECT_EQ(dataset->reasons().of("unfinished"), 1u);
      opened += allOf(*dataset).order.empty() ? 0 : 1;
    });
    EXPECT_TRUE(refusal.empty() || refusal.find(bag.string()) != std::string::npos) << refusal;
  }
  EXPECT_GE(opened, 1);
}

TEST(RosStrangers, AnMcapOfNpmIsTheDriveRawAndPacked) {
  if (!Npm::one().whyNot().empty()) GTEST_SKIP() << Npm::one().whyNot();
  const Tiny raw("mcap_raw"), png("mcap_png", {.images = PlanOptions::Images::kPng});
  for (const Tiny* tiny : {&raw, &png}) {
    Npm::one().run({"write_mcap.mjs", tiny->plan.string(), (tiny->out / "run.mcap").string()});
    expectTheFolders(tiny->folder, tiny->out / "run.mcap", tiny->rig);
    expectTheFolders(tiny->folder, tiny->out, tiny->rig);  // the folder is as rosbag2 writes it
  }
}

}  // namespace
}  // namespace perdure::test
