// Tests doctor's findings about the size of a network's input and of a camera's images.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "common/replay/data_check.h"
#include "common/replay/dataset.h"
#include "tests/common/replay/tiny_datasets.h"
#include "tools/bus_tools/doctor/doctor.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

/// Writes only a description, because these tests do not run the network.
fs::path networkOf(const fs::path& folder, int width, int height) {
  std::ofstream(folder / "net.onnx") << "\x08\x07 no network";
  std::ofstream(folder / "net.onnx.model.json")
      << R"({"family": "yolox", "classes": ["car"], "activation": {"class": "sigmoid"},
            "input": {"width": )"
      << width << R"(, "height": )" << height << R"(, "fit": "letterbox_centre", "colour": "bgr"},
            "levels": [{"stride": 32, "box": "b", "objectness": "o", "classes": "c"}]})";
  return folder / "net.onnx";
}

TEST(DoctorOfNetworks, WarnsOfAShapeThatWastesAThirdOfTheInput) {
  const fs::path drive = replay::tinyEuroc("doctor_shape");
  const fs::path folder = replay::freshFolder("doctor_network");
  const auto camera = replay::Dataset::open({.path = drive})->calibration().cameras.front();
  const int side = 32 * 8;
  const auto other = static_cast<int>(side * camera.height / camera.width / 32 * 32);
  EXPECT_TRUE(
      checkNetworkShape({.data = drive}, networkOf(folder, side, std::max(32, other))).empty());
  const Findings found = checkNetworkShape({.data = drive}, networkOf(folder, 4 * side, 64));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].verdict, Verdict::kWarn);
  EXPECT_THAT(found[0].text, HasSubstr("--input camera --image PICTURE"));
}

TEST(DoctorOfNetworks, TheServicesOwnIsTakenFromItsConfiguration) {
  const fs::path folder = replay::freshFolder("doctor_config");
  EXPECT_EQ(configuredNetwork(folder), "");
  std::ofstream(folder / "inference.yaml") << "model:\n  path: /here/net.onnx\n";
  EXPECT_EQ(configuredNetwork(folder), "/here/net.onnx");
  std::ofstream(folder / "inference.yaml") << "model: [\n";
  EXPECT_EQ(configuredNetwork(folder), "");
}

TEST(DoctorOfRecordings, ACameraThatHangsUpsideDownIsFineWhereVioAgrees) {
  const std::string told = std::string(replay::kUpsideDown) + ": by T_BS …";
  Findings findings{{Verdict::kWarn, told}, {Verdict::kWarn, "another"}};
  settleUpsideDown(false, findings);
  EXPECT_EQ(findings[0].text, told);
  settleUpsideDown(true, findings);
  EXPECT_EQ(findings[0].verdict, Verdict::kOk);
  EXPECT_EQ(findings[1].verdict, Verdict::kWarn);
}

TEST(DoctorOfRecordings, TakesOneSequenceOfSeveral) {
  const fs::path root = replay::tinyKittiTracking("doctor_tracking");
  EXPECT_THAT(replay::startupErrorOf([&] { checkRigBy({.data = root}, 10.0); }),
              HasSubstr("name one with --sequence (0000, 0001)"));
  // a sequence with images, and one with labels only
  for (const char* sequence : {"0000", "0001"}) {
    const Findings found = checkRigBy({.data = root, .sequence = sequence}, 10.0);
    ASSERT_FALSE(found.empty());
    EXPECT_THAT(found.back().text, HasSubstr("as always in KITTI tracking")) << sequence;
  }
}

TEST(DoctorOfRecordings, FindsNothingWrongWithTheLayoutOf7Scenes) {
  const fs::path scene = replay::tinySevenScenes("doctor_scene");
  const Findings found = checkRigBy({.data = scene}, 10.0);
  ASSERT_GE(found.size(), 2u);
  for (const Finding& finding : found) {
    EXPECT_NE(finding.verdict, Verdict::kFail) << finding.text;
  }
  EXPECT_EQ(found.back().verdict, Verdict::kOk);
  EXPECT_THAT(found.back().text, HasSubstr("--odometry truth"));
  for (const char* name : {"0", "1", "2"}) {
    replay::writeGrey(scene / ("frame-00000" + std::string(name) + ".color.png"), 640, 480, 90);
  }
  const Findings grey = checkRigBy({.data = scene}, 10.0);
  EXPECT_TRUE(std::any_of(grey.begin(), grey.end(), [](const Finding& finding) {
    return finding.verdict == Verdict::kWarn;
  })) << "images of one grey";
}

TEST(DoctorOfRecordings, LooksAtPosesOfAnotherProgram) {
  const fs::path scene = replay::tinySevenScenes("doctor_poses"), file = scene / "poses.tum";
  const auto dataset = replay::Dataset::open({.path = scene});
  const auto lastOf = [&](double later_s) {
    std::ofstream poses(file);
    for (const auto& frame : dataset->recording().frames) {
      poses << fmt::format("{:.6f} 0 0 0 0 0 0 1\n",
                           1e-9 * static_cast<double>(toNanoseconds(frame.time)) + later_s);
    }
    poses.close();
    const Findings found = checkRigBy({.data = scene, .poses = file}, 10.0);
    return found.at(found.size() - (found.back().verdict == Verdict::kFail ? 1 : 2));
  };
  EXPECT_EQ(lastOf(0.0).text, "the poses agree with images and inertial samples");
  const Finding elsewhere = lastOf(1000.0);
  EXPECT_EQ(elsewhere.verdict, Verdict::kFail);
  EXPECT_THAT(elsewhere.text, HasSubstr("no frame has a pose"));
}

}  // namespace
}  // namespace perdure::tools
