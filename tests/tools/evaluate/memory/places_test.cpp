#include "tools/evaluate/memory/places.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <list>
#include <nlohmann/json.hpp>
#include <numeric>

#include "common/base/errors.h"
#include "common/replay/dataset.h"
#include "tests/common/replay/tiny_datasets.h"
#include "tools/perdure/commands.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using replay::startupErrorOf;
using replay::writeText;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// A body that drives along x, one metre a frame, in a W that has drifted to the left by 30 m.
struct DrivePastPlaces {
  Places places;
  std::map<std::uint64_t, PlaceFrame> frames;
  std::list<EstimateRow> rows;
  RunEvents events;
  PlaceOptions options;

  DrivePastPlaces() {
    for (std::uint64_t i = 0; i < 40; ++i) {
      const RigidTransform drift(Eigen::Matrix3d::Identity(), Eigen::Vector3d(0, 30, 0));
      frames[i] = {RigidTransform(Eigen::Matrix3d::Identity(),
                                  Eigen::Vector3d(static_cast<double>(i), 30, 0)),
                   drift,
                   {}};
    }
  }
  void visit(std::uint64_t place, std::uint64_t number, double x, std::uint64_t first,
             std::uint64_t count = 8) {
    PlaceVisit one{Eigen::Vector3d(x, 0, 1), std::vector<std::uint64_t>(count)};
    std::iota(one.frames.begin(), one.frames.end(), first);
    places[place][number] = one;
  }
  /// An object of a class at a place of the true frame, in some frames.
  void report(std::uint64_t id, double x, double y, std::uint64_t first, std::uint64_t count = 8,
              const std::string& class_name = "car") {
    for (std::uint64_t i = first; i < first + count; ++i) {
      EstimateRow row;
      row.id = id;
      row.class_name = class_name;
      row.centre_W = Eigen::Vector3d(x, y + 30, 0);
      frames[i].rows.push_back(&rows.emplace_back(row));
    }
  }
  PlaceScore score() const { return scorePlaces(places, frames, events, options); }
};

TEST(Places, AMergeAfterTheVisitKeepsTheIdAtTheEndOnly) {
  DrivePastPlaces drive;
  drive.visit(5, 0, 20, 0), drive.visit(5, 1, 40, 20);
  drive.report(7, 21, 0.5, 0), drive.report(9, 41, 0.5, 20);
  EXPECT_EQ(drive.score().visited_twice, 1U);
  EXPECT_EQ(drive.score().kept, 0U);
  drive.events.merged = {{9, 8}, {8, 7}, {3, 4}, {4, 3}};
  EXPECT_EQ(drive.score().kept, 1U);
  EXPECT_EQ(drive.score().kept_in_visit, 0U);
  EXPECT_EQ(drive.score().without, 0U);
  EXPECT_EQ(drive.events.finalId(3), 3U) << "merged, split and merged the other way round";
}

TEST(Places, AVisitWithoutAnObjectCountsAsLostAndAShortOneDoesNotCount) {
  DrivePastPlaces drive;
  drive.visit(1, 0, 20, 0), drive.visit(1, 1, 40, 20);
  drive.visit(2, 0, 30, 0), drive.visit(2, 1, 30, 20, 7);
  drive.report(7, 21, 0, 0);
  const PlaceScore score = drive.score();
  EXPECT_EQ(score.visited_twice, 1U);
  EXPECT_EQ(score.without, 1U);
  EXPECT_EQ(score.kept, 0U);
}

TEST(Places, TheObjectIsTheNearestToTheMiddleOfTheLimits) {
  DrivePastPlaces drive;
  drive.visit(1, 0, 20, 0, 1);
  drive.report(6, 23.6, 0, 0, 1), drive.report(7, 19, 0.3, 0, 1);
  drive.report(8, 20, 1.3, 0, 1), drive.report(9, 20.8, 0.4, 0, 1, "van");
  EXPECT_THAT(drive.score().along_m, ElementsAre(::testing::DoubleNear(0.8, 1e-9)));
  EXPECT_THAT(drive.score().across_m, ElementsAre(::testing::DoubleNear(0.4, 1e-9)));
  drive.options.class_name = "car";
  EXPECT_THAT(drive.score().along_m, ElementsAre(::testing::DoubleNear(-1.0, 1e-9)));
  drive.options.along_m = {-0.5, 4.0};
  EXPECT_THAT(drive.score().along_m, ElementsAre(::testing::DoubleNear(3.6, 1e-9)));
}

TEST(Places, RecallIsThatOfTheFramesWithinRange) {
  DrivePastPlaces drive;
  drive.visit(1, 0, 28, 0, 10);  // 28 to 19 m before the body: seven frames within 25 m
  drive.visit(1, 1, 28, 20, 5);  // 8 to 4 m: four frames beyond 5 m
  drive.report(7, 29, 0, 0, 5), drive.report(7, 29, 0, 20, 4);
  const PlaceScore score = drive.score();
  EXPECT_EQ(score.first_asked, 7U);
  EXPECT_EQ(score.first_found, 2U);
  EXPECT_EQ(score.later_asked, 4U);
  EXPECT_EQ(score.later_found, 4U);
}

std::string errorOfPlaces(const std::string& text) {
  const auto file = replay::freshFolder("places") / "places.csv";
  writeText(file, text);
  return startupErrorOf([&] { readPlaces(file); });
}

TEST(Places, WrongLinesAreLocated) {
  const std::string header = "place,visit,x,y,z,frames\n";
  EXPECT_EQ(errorOfPlaces(header + "0,0,1,2,3,4 5 6\n0,1,1,2,3,9\n"), "");
  EXPECT_THAT(errorOfPlaces("place,x,y\n"), HasSubstr("places.csv:1: the header is place,visit,"));
  EXPECT_THAT(errorOfPlaces(header + "0,0,1,2,3\n"), HasSubstr(":2: 5 columns; a row is place"));
  EXPECT_THAT(errorOfPlaces(header + "0,-1,1,2,3,4\n"), HasSubstr(":2: place and visit"));
  EXPECT_THAT(errorOfPlaces(header + "0,0,1e160,2,3,4\n"), HasSubstr("within 1e7 m"));
  EXPECT_THAT(errorOfPlaces(header + "0,0,1,2,3,4 5 4\n"), HasSubstr(":2: frame 4 is named twice"));
  EXPECT_THAT(errorOfPlaces(header + "0,0,1,nan,3,4\n"),
              HasSubstr(":2: x, y and z are numbers within 1e7 m"));
  EXPECT_THAT(errorOfPlaces(header + "0,0,1,2,3,4;5\n"), HasSubstr(":2: frames are whole"));
  EXPECT_THAT(errorOfPlaces(header + "0,0,1,2,3,\n"), HasSubstr(":2: the visit has no frames"));
  EXPECT_THAT(errorOfPlaces(header + "0,0,1,2,3,4\n0,0,1,2,3,5\n"),
              HasSubstr(":3: an earlier line has this visit"));
}

/// A run over the frames of a tiny folder, along x; a car stands at x = 20, and its place is one
/// metre before it. Poses and places are those of the camera in the frame of its first pose.
struct TinyRun {
  fs::path root, run, truth, places;

  explicit TinyRun(const std::string& name)
      : root(replay::tinyEuroc(name)),
        run(root / "run"),
        truth(root / "truth.tum"),
        places(root / "places.csv") {
    const auto data = replay::Dataset::open({.path = root, .decode = false});
    const RigidTransform T_BC = data->calibration().cameras.front().T_BC;
    std::string poses, trajectory, rows;
    for (int i = 0; i < 5; ++i) {
      const RigidTransform T_WB(Eigen::Matrix3d::Identity(), Eigen::Vector3d(i, 0, 0));
      const RigidTransform T_PC = T_BC.inverse() * T_WB * T_BC;
      poses += line(i, T_PC);
      trajectory += line(i, T_WB);
      rows += "T," + std::to_string(i) + ",0,9,car,0.9,20,0.2,0,4,1.7,1.5,0.5,1\n";
    }
    writeText(truth, poses);
    writeText(run / "trajectory.tum", trajectory);
    writeText(run / "objects_inst.csv",
              "sequence,frame,timestamp_ns,object_id,class,score,x,y,z,l,w,h,yaw,visible\n" + rows);
    writeText(run / "events.jsonl", "{\"event\":\"gone\",\"object_id\":3}\n");
    writeText(run / "report.json", nlohmann::json({{"data", root.string()}}).dump());
    const Eigen::Vector3d p = T_BC.inverse() * Eigen::Vector3d(19, 0, 0);
    const std::string at =
        std::to_string(p.x()) + "," + std::to_string(p.y()) + "," + std::to_string(p.z()) + ",";
    writeText(places, "place,visit,x,y,z,frames\n0,0," + at + "0 1\n0,1," + at + "3 4 90\n");
  }
  static std::string line(int i, const RigidTransform& T) {
    std::string text = std::to_string(1.0 + 0.05 * i);
    for (const double v : {T.p.x(), T.p.y(), T.p.z(), T.q.x(), T.q.y(), T.q.z(), T.q.w()}) {
      text += " " + std::to_string(v);
    }
    return text + "\n";
  }
  std::vector<std::string> arguments() const {
    return {run, "--truth", truth, "--places", places, "--least-frames", "2"};
  }
};

void callMemory(std::vector<std::string> arguments) {
  CLI::App app;
  setUpEvaluate(app);
  arguments.insert(arguments.begin(), "memory");
  std::reverse(arguments.begin(), arguments.end());
  app.parse(arguments);
}

std::string saidOfPlaces(const std::vector<std::string>& arguments) {
  ::testing::internal::CaptureStdout();
  callMemory(arguments);
  std::fflush(stdout);
  return ::testing::internal::GetCapturedStdout();
}

TEST(PlacesCommand, TheCamerasPlaceOnTheBodyIsThatOfTheData) {
  const TinyRun tiny("places_run");
  auto arguments = tiny.arguments();
  EXPECT_THAT(saidOfPlaces(arguments),
              AllOf(HasSubstr("sightings: 4\nrecall: 1.000\n"), HasSubstr("gone: 1\n")));
  arguments.push_back("--json");
  auto json = nlohmann::json::parse(saidOfPlaces(arguments));
  EXPECT_EQ(json["places_visited_twice"], 1);
  EXPECT_EQ(json["ids_kept"], 1.0);
  EXPECT_NEAR(json["along_m"], 1.0, 1e-4);
  EXPECT_NEAR(json["across_m"], 0.2, 1e-2);
  EXPECT_NEAR(json["ate_odometry_m"], 0.0, 1e-5);
  EXPECT_TRUE(json["ate_map_m"].is_null());
  // The poses of the body are the trajectory itself, and places are then in W.
  writeText(tiny.places, "place,visit,x,y,z,frames\n0,0,19,0,0,0 1\n");
  arguments[2] = (tiny.run / "trajectory.tum").string();
  arguments.push_back("--body-poses");
  json = nlohmann::json::parse(saidOfPlaces(arguments));
  EXPECT_NEAR(json["along_m"], 1.0, 1e-4);
  EXPECT_EQ(json["recall"], 1.0);
}

TEST(PlacesCommand, WhatIsMissingOrContradictsIsNamed) {
  const TinyRun tiny("places_missing");
  const auto error = [&](std::vector<std::string> more) {
    auto arguments = tiny.arguments();
    arguments.insert(arguments.end(), more.begin(), more.end());
    return startupErrorOf([&] { callMemory(arguments); });
  };
  EXPECT_THAT(error({"--range", "25", "5"}), HasSubstr("--range: the limits are 25 and 5"));
  for (const char* across : {"nan", "-1", "inf"}) {
    EXPECT_THAT(error({"--across", across}), HasSubstr("--across: the limits are 0 and "));
  }
  EXPECT_THAT(error({"--range", "50", "60"}), HasSubstr("no place is within --range"));
  EXPECT_THROW(callMemory({tiny.run, "--truth", tiny.truth, "--across", "2"}), CLI::RequiresError);
  EXPECT_THROW(error({"--map-run", tiny.run}), CLI::ExcludesError);
  writeText(tiny.run / "events.jsonl", "{\"event\":\"gone\"}\n{}\n");
  EXPECT_THAT(error({}), HasSubstr("events.jsonl:2: no event of"));
  fs::remove(tiny.run / "report.json");
  EXPECT_THAT(error({}), HasSubstr("give --data"));
  writeText(tiny.truth, "70 0 0 0 0 0 0 1\n71 0 0 0 0 0 0 1\n");
  EXPECT_THAT(error({"--data", tiny.root}), HasSubstr("fewer than two frames in common"));
}

}  // namespace
}  // namespace perdure::tools
