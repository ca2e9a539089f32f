// Tests where to look next, on a map's file.
#include "tools/map/look.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "common/base/errors.h"
#include "common/replay/files/rig_file.h"
#include "services/map_store/core/map_database.h"
#include "tests/services/map_store/beliefs.h"
#include "tests/services/semantic_filter/scene.h"
#include "tools/map/look_command.h"

namespace perdure::tools {
namespace {

using ::testing::HasSubstr;

constexpr double kAside_m = 8.0;

/// Two anchors on a street along x with three cars. The graph has moved the second by 8 m.
class MapLook : public ::testing::Test {
 protected:
  MapLook() {
    mapping::Unsaved unsaved;
    mapping::SavedMap& map = unsaved.changed;
    map.classes = {"car"};
    for (mapping::AnchorId id = 1; id <= 2; ++id) {
      mapping::SavedAnchor& saved = map.anchors[id];
      saved.anchor.id = id;
      saved.anchor.previous = id - 1;
      saved.anchor.session = {77, 1};
      saved.anchor.stamp.time = fromNanoseconds(1'000'000'000 * static_cast<std::int64_t>(id));
      saved.anchor.T_WA.p = {100.0 * static_cast<double>(id - 1), 0.0, 1.2};
      saved.anchor.from_previous.mean.p.x() = id == 1 ? 0.0 : 100.0;
      saved.anchor.from_previous.covariance = Eigen::Matrix4d::Identity();
      saved.T_MA.p = saved.anchor.T_WA.p;
      saved.held_fast = id == 1;
    }
    map.anchors[2].T_MA.p.y() = kAside_m;
    std::vector<ObjectBelief> cars;
    for (ObjectId id = 1; id <= 3; ++id) {
      cars.push_back(car(id, 10.0 + 9.0 * double(id), id == 2 ? -3.0 : 2.0 * double(id)));
    }
    cars.push_back(car(4, 112.0, 3.0));
    for (ObjectId id = 1; id <= 4; ++id) {
      mapping::ObjectRecord& record = map.records[id];
      record.session = {77, 1};
      record.last_seen = cars[id - 1].last_seen;
      record.confirmed = true;
      record.sighting.anchor = id == 4 ? 2 : 1;
      record.sighting.in_anchor.id = id;
      record.sighting.in_anchor.pmf = {{0, 1.0}};
    }
    const Objects objects = map_store::test::workingSet(1, cars);
    map_store::MapDatabase database({path_});
    EXPECT_TRUE(database.takeGraph().has_value());
    EXPECT_TRUE(database.write({&objects, {}, {}, {}, &unsaved}).has_value());
    Calibration rig;
    rig.cameras = {semantic_filter::testing::makeCamera()};
    std::ofstream(rig_) << replay::rigText(rig, "test");
  }
  static ObjectBelief car(ObjectId id, double x, double y) {
    ObjectBelief belief = map_store::test::carAt(id, {x, y, 0.75});
    belief.classes.resize(1);
    belief.classes[0].probability = 1.0;
    belief.classes[0].covariance = 0.04 * Matrix7d::Identity();
    belief.classes[0].cross_pose.setZero();
    belief.seen_from.setConstant(30.0F);
    return belief;
  }
  static TimedView pose(double x, double y, double yaw, TimePoint time) {
    return {{Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())), {x, y, 1.2}},
            time};
  }
  /// Runs the command, and returns what it prints.
  std::string print(std::vector<std::string> words) const {
    CLI::App app;
    addLookCommand(app);
    words.insert(words.begin(), {"look", path_});
    words.insert(words.end(), {"--rig", rig_});
    std::reverse(words.begin(), words.end());
    ::testing::internal::CaptureStdout();
    try {
      app.parse(words);
    } catch (...) {
      ::testing::internal::GetCapturedStdout();
      throw;
    }
    return ::testing::internal::GetCapturedStdout();
  }
  nlohmann::json prospects(std::vector<std::string> words) const {
    words.emplace_back("--json");
    return nlohmann::json::parse(print(std::move(words)))["prospects"];
  }
  std::string plan(const std::string& lines) const {
    std::ofstream(folder_.file("plan.tum")) << lines;
    return folder_.file("plan.tum");
  }

  map_store::test::TemporaryFolder folder_;
  std::string path_ = folder_.file("map.sqlite"), rig_ = folder_.file("rig.yaml");
};

TEST_F(MapLook, ReadsObjectsAndPastPosesInM) {
  const MapToLook map = readMapToLook(path_);
  ASSERT_EQ(map.past.size(), 2u);
  EXPECT_NEAR(map.past[1].T_WB.p.y(), kAside_m, 1e-9);
  ASSERT_EQ(map.beliefs.size(), 4u);
  EXPECT_NEAR(map.beliefs[3].best().mean.y(), 3.0 + kAside_m, 1e-9);
  EXPECT_GE(map.newest, map.past[1].time);
}

TEST_F(MapLook, APoseThatFacesTheCarsIsBetterThanOneThatFacesAway) {
  const auto ranked =
      prospects({"--poses", plan("0 0 0 1.2 0 0 1 0\n1 0 0 1.2 0 0 0 1\n"), "--by", "existence"});
  ASSERT_EQ(ranked.size(), 2u);
  EXPECT_NEAR(ranked[0]["views"][0]["yaw"].get<double>(), 0.0, 1e-9);
  EXPECT_GT(ranked[0]["bits"]["existence"], 0.1);
  EXPECT_EQ(ranked[1]["bits"]["existence"], 0.0);
  EXPECT_EQ(ranked[0]["objects"].size(), 3u);
}

TEST_F(MapLook, ARouteAddsUpWithoutCountingTwice) {
  const auto bits = [&](const std::string& option, const std::string& lines) {
    return prospects({option, plan(lines)})[0]["bits"]["total"].get<double>();
  };
  const std::string here = "0 0 0 1.2 0 0 0 1\n";
  const double once = bits("--route", here);
  const double again = bits("--route", here + "1 0 0 1.2 0 0 0 1\n");
  const double on = bits("--route", here + "1 100 8 1.2 0 0 0 1\n");
  EXPECT_NEAR(once, bits("--poses", here), 1e-9);
  EXPECT_GT(again, once);
  EXPECT_GT(on, again) << "the fourth car";
  EXPECT_THAT(print({"--route", plan(here + "1 100 8 1.2 0 0 0 1\n")}), HasSubstr("    100 "));
}

TEST_F(MapLook, ObjectsBecomeDoubtfulWithTime) {
  const auto at = [&](const char* after) {
    return prospects({"--pose", "0", "0", "1.2", "0", "--after", after})[0];
  };
  const auto now = at("0"), later = at("1800");
  EXPECT_GT(later["bits"]["existence"], 2.0 * now["bits"]["existence"].get<double>());
  EXPECT_NEAR(later["objects"][0]["existence"], 0.97 * std::exp(-0.5), 0.01);
}

TEST_F(MapLook, PosesAroundAPlaceAreAtAnchorsInEightDirections) {
  EXPECT_EQ(prospects({"--around", "3", "0", "10"}).size(), 8u);
  EXPECT_EQ(prospects({"--around", "50", "0", "80", "--most", "100"}).size(), 16u);
  EXPECT_THROW(print({"--around", "50", "0", "10"}), StartupError);
}

TEST_F(MapLook, WrongRequestsAreRefusedWithTheirCause) {
  const auto fault = [&](std::vector<std::string> words) -> std::pair<ExitCode, std::string> {
    try {
      print(std::move(words));
    } catch (const StartupError& error) {
      return {error.code(), error.what()};
    }
    return {};
  };
  EXPECT_THROW(print({}), CLI::ParseError);
  EXPECT_THROW(print({"--pose", "0", "0", "1", "0", "--around", "0", "0", "9"}), CLI::ParseError);
  const auto no_tum = fault({"--poses", plan("0 0 0\n")});
  EXPECT_EQ(no_tum.first, ExitCode::kData);
  EXPECT_THAT(no_tum.second, HasSubstr("plan.tum"));
  const auto no_config = fault({"--pose", "0", "0", "1", "0", "--config", "absent.yaml"});
  EXPECT_THAT(no_config.second, HasSubstr("absent.yaml"));
  const auto no_radius = fault({"--around", "0", "0", "-3"});
  EXPECT_EQ(no_radius.first, ExitCode::kUsage);
  EXPECT_THAT(no_radius.second, HasSubstr("radius of -3 m"));
  Calibration upright_phone;
  upright_phone.cameras = {semantic_filter::testing::makeCamera()};
  upright_phone.cameras[0].T_BC = RigidTransform();
  std::ofstream(rig_) << replay::rigText(upright_phone, "test");
  EXPECT_THAT(fault({"--pose", "0", "0", "1", "0"}).second, HasSubstr("looks up or down"));
}

}  // namespace
}  // namespace perdure::tools
