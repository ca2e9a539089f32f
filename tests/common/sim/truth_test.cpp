#include "common/sim/truth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "common/base/errors.h"
#include "common/math/so3.h"

namespace perdure::sim {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

constexpr TimePoint kEpoch = fromNanoseconds(1'000'000'000'000);
constexpr char kHeader[] = "frame,object_id,visible_fraction,x1,y1,x2,y2\n";

SceneObject chair(std::uint64_t id, Trajectory motion) {
  SceneObject object;
  object.id = id;
  object.class_name = object.looks_like = "chair";
  object.size = {0.5, 0.45, 0.9};
  object.motion = std::move(motion);
  return object;
}

RigidTransform place(double x, double yaw) {
  return RigidTransform(rotationAboutZ(yaw), Eigen::Vector3d(x, 1.0 / 3.0, 0.45));
}

class TruthFolder : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("perdure_truth_" + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  void writeOneChair() const {
    Scene scene;
    scene.seconds = 1.0;
    scene.objects = {chair(4, Trajectory(place(2, 0.5)))};
    writeObjectsTruth(folder_, truthOf(scene, kEpoch));
  }
  /// Returns the error of reading; empty on success.
  std::string complaint() const {
    try {
      readTruth(folder_);
    } catch (const StartupError& error) {
      EXPECT_EQ(error.code(), ExitCode::kUnavailable);
      return error.what();
    }
    return {};
  }
  fs::path folder_;
};

TEST_F(TruthFolder, ComesBackAsItWasWritten) {
  Scene scene;
  scene.seconds = 3.0;
  scene.objects = {chair(4, Trajectory(place(2, 0.5)))};
  scene.objects[0].looks_like = "couch";
  scene.objects[0].present_until_s = 1.5;
  writeObjectsTruth(folder_, truthOf(scene, kEpoch));
  write("visibility_truth.csv", std::string(kHeader) + "0,4,0.5,-3.25,1,20,30\n7,4,0,1,2,3,4\n");
  EXPECT_TRUE(hasTruth(folder_));
  const Truth truth = readTruth(folder_);
  ASSERT_EQ(truth.objects.size(), 1u);
  const TruthObject& object = truth.objects[0];
  EXPECT_EQ(object.id, 4u);
  EXPECT_EQ(object.class_name, "chair");
  EXPECT_EQ(object.looks_like, "couch");
  EXPECT_EQ(object.size, Eigen::Vector3d(0.5, 0.45, 0.9));
  ASSERT_EQ(object.keys.size(), 1u);
  EXPECT_EQ(object.keys[0].centre_W.y(), 1.0 / 3.0);
  EXPECT_NEAR(object.keys[0].yaw, 0.5, 1e-12);
  EXPECT_TRUE(object.presentAt(kEpoch + durationFromSeconds(1.4)));
  EXPECT_FALSE(object.presentAt(kEpoch + durationFromSeconds(1.5)));
  ASSERT_EQ(truth.views.at(0).size(), 1u);
  EXPECT_EQ(truth.views.at(0)[0].box.x1, -3.25);
  EXPECT_EQ(truth.views.at(7)[0].visible_fraction, 0.0);
  EXPECT_FALSE(truth.views.contains(1));
}

TEST_F(TruthFolder, IsTheSameBytesTwice) {
  Scene scene;
  scene.seconds = 2.0;
  scene.objects = {chair(1, Trajectory(0.2, 0.1, {place(0, 0), place(1, 1)}))};
  scene.objects[0].moves = true;
  const auto bytes = [&] {
    writeObjectsTruth(folder_, truthOf(scene, kEpoch));
    std::ifstream stream(folder_ / "objects_truth.json", std::ios::binary);
    return std::string{std::istreambuf_iterator<char>(stream), {}};
  };
  const std::string first = bytes();
  EXPECT_GT(first.size(), 100u);
  EXPECT_EQ(first, bytes());
}

TEST(TruthOf, AMovingObjectFollowsItsMotion) {
  std::vector<RigidTransform> controls;
  for (int i = 0; i < 21; ++i) controls.push_back(place(2.0 * i, 3.0 + 0.05 * i));
  Scene scene;
  scene.seconds = 10.0;
  scene.objects = {chair(1, Trajectory(0.0, 0.5, controls))};
  scene.objects[0].moves = true;
  const TruthObject truth = truthOf(scene, kEpoch).at(0);
  for (double t = 0.0; t <= 10.0; t += 0.013) {
    const RigidTransform T_WO = scene.objects[0].motion.poseAt(t);
    const TruthKey key = truth.at(kEpoch + durationFromSeconds(t));
    EXPECT_LT((key.centre_W - T_WO.p).norm(), 0.01) << t;
    EXPECT_NEAR(wrapAngle(key.yaw - yawOf(T_WO.R())), 0.0, 0.01) << t;
  }
}

TEST(TruthOf, AMovingObjectThatRestsNeedsFewKeys) {
  Scene scene;
  scene.seconds = 100.0;
  scene.objects = {chair(1, Trajectory(50.0, 0.5, {place(0, 0), place(1, 0), place(2, 0)}))};
  scene.objects[0].moves = true;
  const TruthObject truth = truthOf(scene, kEpoch).at(0);
  EXPECT_LT(truth.keys.size(), 50u);
  EXPECT_EQ(truth.at(kEpoch + durationFromSeconds(40)).centre_W.x(), 0.0);
  EXPECT_NEAR(truth.at(kEpoch + durationFromSeconds(90)).centre_W.x(), 2.0, 1e-12);
}

TEST(TruthOf, AThingMovedAtOnceHasTwoKeys) {
  Scene scene;
  scene.seconds = 10.0;
  scene.objects = {chair(1, Trajectory(4.2345, 1e-4, {place(0, 0), place(3, 1)}))};
  const TruthObject truth = truthOf(scene, kEpoch).at(0);
  ASSERT_EQ(truth.keys.size(), 2u);
  EXPECT_NEAR(toSeconds(truth.keys[1].time - kEpoch), 4.2345, 1e-3);
  EXPECT_EQ(truth.at(kEpoch + durationFromSeconds(4.2)).centre_W.x(), 0.0);
  EXPECT_NEAR(truth.at(kEpoch + durationFromSeconds(4.3)).centre_W.x(), 3.0, 1e-12);
}

TEST_F(TruthFolder, ThatIsMissingIsNamed) {
  EXPECT_FALSE(hasTruth(folder_));
  EXPECT_THAT(complaint(), AllOf(HasSubstr("objects_truth.json"), HasSubstr("is missing"),
                                 HasSubstr("perdure simulate")));
  writeOneChair();
  EXPECT_THAT(complaint(), AllOf(HasSubstr("visibility_truth.csv"), HasSubstr("is missing")));
}

TEST_F(TruthFolder, WhoseObjectsAreWrongSaysWhichAndWhat) {
  const std::string good =
      R"({"id":1,"class":"car","looks_like":"car","size":[4,2,1.5],"moves":false,)"
      R"("present_from_ns":0,"present_until_ns":9,"keys":[{"time_ns":0,"centre":[1,2,3],"yaw":0}]})";
  write("visibility_truth.csv", kHeader);
  const auto complaintOf = [&](const std::string& from, const std::string& to) {
    std::string changed = good;
    const auto at = changed.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    write("objects_truth.json", "{\"objects\": [" + changed.replace(at, from.size(), to) + "]}");
    return complaint();
  };
  EXPECT_EQ(complaintOf("[4,2,1.5]", "[4,2,1.6]"), "");
  EXPECT_THAT(complaintOf("[4,2,1.5]", "[4,0,1.5]"), HasSubstr("objects[0]: size is not above 0"));
  EXPECT_THAT(complaintOf("[4,2,1.5]", "[4,2]"), HasSubstr("size has not 3 numbers"));
  EXPECT_THAT(complaintOf("\"class\":\"car\"", "\"class\":7"), HasSubstr("class is not a name"));
  EXPECT_THAT(complaintOf("\"class\":\"car\"", "\"class\":\"\""), HasSubstr("class is not a name"));
  EXPECT_THAT(complaintOf("\"moves\":false", "\"moves\":0"), HasSubstr("is not true or false"));
  EXPECT_THAT(complaintOf("\"yaw\":0", "\"yaw\":true"), HasSubstr("yaw is not a number"));
  EXPECT_THAT(complaintOf("[4,2,1.5]", "[4,true,1.5]"), HasSubstr("size has not 3 numbers"));
  EXPECT_THAT(complaintOf("\"id\":1", "\"id\":true"), HasSubstr("id is not an integer"));
  EXPECT_THAT(complaintOf("\"id\":1", "\"id\":0"), HasSubstr("id is not above 0"));
  EXPECT_THAT(complaintOf("\"id\":1", "\"id\":1.5"), HasSubstr("id is not an integer"));
  EXPECT_THAT(complaintOf("\"id\":1", "\"id\":18446744073709551615"),
              HasSubstr("id is not above 0"));
  EXPECT_THAT(complaintOf("\"moves\":false,", ""), HasSubstr("moves is missing"));
  EXPECT_THAT(complaintOf("_until_ns\":9", "_until_ns\":0"), HasSubstr("present_until_ns"));
  EXPECT_THAT(complaintOf("{\"time_ns\":0,\"centre\":[1,2,3],\"yaw\":0}", ""),
              HasSubstr("keys is not a list with at least one"));
  EXPECT_THAT(complaintOf("}]}", "}]}," + good), HasSubstr("objects[1]: its id was there before"));
  write("objects_truth.json", "{\"objects\": [" + good.substr(0, 40));
  EXPECT_THAT(complaint(), HasSubstr("is cut or no JSON"));
  write("objects_truth.json", "[]");
  EXPECT_THAT(complaint(), HasSubstr("no list named objects"));
}

TEST_F(TruthFolder, HasTheBoxInsideWhereTheBorderCuts) {
  writeOneChair();
  write("visibility_truth.csv", std::string(kHeader) + "0,4,0.5,-3.25,1,20,30\n7,4,0,1,2,3,4\n");
  EXPECT_EQ(readTruth(folder_).views.at(0)[0].boxInside(15.0, 30.0).x2, 15.0) << "of before";
  const std::string header = "frame,object_id,x1,y1,x2,y2\n";
  write("inside_truth.csv", header + "0,4,-0.5,3,20,28\n");
  const Truth truth = readTruth(folder_);
  const Box cut = truth.views.at(0)[0].boxInside(640.0, 480.0);
  EXPECT_EQ(cut.x1, 0.0);
  EXPECT_EQ(cut.y1, 3.0);
  EXPECT_EQ(cut.y2, 28.0);
  EXPECT_FALSE(truth.views.at(7)[0].inside);
  const auto complaintOf = [&](const std::string& text) {
    write("inside_truth.csv", text);
    return complaint();
  };
  EXPECT_THAT(complaintOf("frame\n"), HasSubstr("inside_truth.csv:1: the header is not frame"));
  EXPECT_THAT(complaintOf(header + "0,4,1,2,3\n"), HasSubstr("csv:2: is not a row of six"));
  EXPECT_THAT(complaintOf(header + "1,4,1,2,3,4\n"), HasSubstr("its frame is not in visibility"));
  EXPECT_THAT(complaintOf(header + "0,5,1,2,3,4\n"), HasSubstr("its object is not in visibility"));
  EXPECT_THAT(complaintOf(header + "0,4,3,2,1,4\n"), HasSubstr("its box is inside out"));
}

TEST_F(TruthFolder, WhoseViewsAreWrongSaysTheLine) {
  writeOneChair();
  const auto complaintOf = [&](const std::string& text) {
    write("visibility_truth.csv", text);
    return complaint();
  };
  const std::string header = kHeader;
  EXPECT_EQ(complaintOf(header + "0,4,1,1,2,3,4\n"), "");
  EXPECT_THAT(complaintOf(""), HasSubstr("is empty"));
  EXPECT_THAT(complaintOf("frame,id\n"), HasSubstr("csv:1: the header is not frame,object_id"));
  EXPECT_THAT(complaintOf(header + "0,4,1,1,2,3\n"), HasSubstr("csv:2: is not a row of seven"));
  EXPECT_THAT(complaintOf(header + "0,4,nan,1,2,3,4\n"), HasSubstr("csv:2: is not a row of seven"));
  EXPECT_THAT(complaintOf(header + "0,4,1,1,2,3,4\n1,4,1,1,2"),
              HasSubstr("csv:3: the file was cut"));
  EXPECT_THAT(complaintOf(header + "0,5,1,1,2,3,4\n"), HasSubstr("not in objects_truth.json"));
  EXPECT_THAT(complaintOf(header + "0,4,1.2,1,2,3,4\n"), HasSubstr("within 0 and 1"));
  EXPECT_THAT(complaintOf(header + "0,4,1,3,2,1,4\n"), HasSubstr("box is empty"));
  EXPECT_THAT(complaintOf(header + "0,4,1,1,2,3,4\n0,4,1,1,2,3,4\n"),
              HasSubstr("csv:3: the object was in this frame before"));
}

}  // namespace
}  // namespace perdure::sim
