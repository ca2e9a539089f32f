// Tests the command `perdure evaluate memory` on a hand-made folder of five frames.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "common/base/errors.h"
#include "tests/common/replay/tiny_datasets.h"
#include "tools/perdure/commands.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using replay::writeText;
using ::testing::HasSubstr;

/// A body at rest at the origin, and a car ten metres ahead; one frame every 50 ms from 1 s on.
fs::path tinySimulated(const std::string& name) {
  const auto root = replay::tinyEuroc(name);
  std::string states = "#timestamp, p, q w x y z, v, b_w, b_a\n";
  for (int i = 0; i < 60; ++i) {
    states += std::to_string(950'000'000 + 5'000'000 * i) + ",0,0,0,1,0,0,0,0,0,0,0,0,0,0,0,0\n";
  }
  writeText(root / "mav0/state_groundtruth_estimate0/data.csv", states);
  writeText(root / "objects_truth.json",
            R"({"objects": [{"id": 4, "class": "car", "looks_like": "car", "size": [4, 1.7, 1.5],
                "moves": false, "present_from_ns": 0, "present_until_ns": 9000000000,
                "keys": [{"time_ns": 0, "centre": [10, 0, 0], "yaw": 0.5}]}]})");
  std::string views = "frame,object_id,visible_fraction,x1,y1,x2,y2\n";
  for (int frame = 0; frame < 5; ++frame) views += std::to_string(frame) + ",4,1.0,6,6,18,16\n";
  writeText(root / "visibility_truth.csv", views);
  return root;
}

std::string poses(double drift) {
  std::string text;
  for (int i = 0; i < 5; ++i) {
    text += std::to_string(1.0 + 0.05 * i) + " " + std::to_string(drift * i) + " 0 0 0 0 0 1\n";
  }
  return text;
}

/// A run that reported the car in the last four frames.
fs::path tinyRun(const fs::path& root, const std::string& name) {
  std::string rows = "sequence,frame,timestamp_ns,object_id,class,score,x,y,z,l,w,h,yaw,visible\n";
  for (int i = 1; i < 5; ++i) {
    rows += "T," + std::to_string(i) + "," + std::to_string(1'000'000'000 + 50'000'000 * i) +
            ",9,car,0.9," + std::to_string(10 + 3 * i) + ",0,0,4,1.7,1.5,0.5,1\n";
  }
  writeText(root / name / "objects_inst.csv", rows);
  writeText(root / name / "trajectory.tum", poses(3.0));
  return root / name;
}

void call(std::vector<std::string> arguments) {
  CLI::App app;
  setUpEvaluate(app);
  arguments.insert(arguments.begin(), "memory");
  std::reverse(arguments.begin(), arguments.end());
  app.parse(arguments);
}

std::string said(const std::vector<std::string>& arguments) {
  ::testing::internal::CaptureStdout();
  call(arguments);
  std::fflush(stdout);
  return ::testing::internal::GetCapturedStdout();
}

TEST(MemoryCommand, TellsProgramsAndPeopleTheSame) {
  const auto root = tinySimulated("memory");
  const auto run = tinyRun(root, "run");
  const auto json = nlohmann::json::parse(said({run, "--truth", root, "--json"}));
  EXPECT_EQ(json["objects"], 1);
  EXPECT_EQ(json["reported_twice"], 0);
  EXPECT_DOUBLE_EQ(json["recall"], 0.8);
  EXPECT_NEAR(json["trajectory"]["ate_from_start_max_m"], 12.0, 1e-6);
  EXPECT_LT(json["trajectory"]["ate_aligned_m"], json["trajectory"]["ate_from_start_m"]);
  EXPECT_FALSE(json.contains("trajectory_map"));
  EXPECT_FALSE(json.contains("map_run"));
  const auto text = said({run, "--truth", root});
  EXPECT_THAT(text, HasSubstr("recall within 25 m: 0.800"));
  EXPECT_THAT(text, HasSubstr("0 reported twice"));
}

TEST(MemoryCommand, TheTrajectoryInTheMapIsScoredWhereThereIsOne) {
  const auto root = tinySimulated("memory_map");
  const auto run = tinyRun(root, "run");
  writeText(run / "trajectory_map.tum", poses(0.0));
  const auto json = nlohmann::json::parse(said({run, "--truth", root, "--json"}));
  EXPECT_NEAR(json["trajectory_map"]["ate_from_start_m"], 0.0, 1e-9);
  EXPECT_THAT(said({run, "--truth", root}), HasSubstr("trajectory in the map: ATE 0.000 m"));
}

TEST(MemoryCommand, ARunWithAMapIsComparedWithTheRunBefore) {
  const auto root = tinySimulated("memory_return");
  const auto before = tinyRun(root, "before"), run = tinyRun(root, "run");
  const std::vector<std::string> arguments{run, "--truth", root, "--map-run", before};
  EXPECT_THAT(said(arguments), HasSubstr("1 with their id (1.000 of all), 0 with another"));
  auto with_json = arguments;
  with_json.push_back("--json");
  const auto json = nlohmann::json::parse(said(with_json))["map_run"];
  EXPECT_EQ(json["kept"], 1);
  EXPECT_NEAR(json["first_s"], 0.05, 1e-9);
  EXPECT_EQ(json["first_objects"], 1);
}

TEST(MemoryCommand, WhatIsMissingIsNamed) {
  const auto root = tinySimulated("memory_missing");
  const auto run = tinyRun(root, "run");
  const auto error = [&](const std::vector<std::string>& arguments) {
    return replay::startupErrorOf([&] { call(arguments); });
  };
  EXPECT_THAT(error({run, "--truth", run}), HasSubstr("perdure simulate"));
  EXPECT_THAT(error({root, "--truth", root}), HasSubstr("objects_inst.csv"));
  fs::remove(run / "trajectory.tum");
  EXPECT_THAT(error({run, "--truth", root}), HasSubstr("trajectory.tum"));
  writeText(run / "trajectory.tum", "70 0 0 0 0 0 0 1\n71 0 0 0 0 0 0 1\n");
  EXPECT_THAT(error({run, "--truth", root}), HasSubstr("fewer than two times in common"));
  EXPECT_THROW(call({run}), CLI::RequiredError);
}

}  // namespace
}  // namespace perdure::tools
