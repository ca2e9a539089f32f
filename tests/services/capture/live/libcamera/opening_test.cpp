// Tests which camera is opened, and when libcamera must search for cameras again.
#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "services/capture/live/libcamera/controls.h"
#include "services/capture/live/libcamera/restart_rule.h"

namespace perdure::capture {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

const std::vector<std::string> kIds = {"usb-1.2:046d", "usb-1:046d", "imx219"};

TEST(CameraChoice, OneCameraIsTheFirstThatHasTheIdInIts) {
  EXPECT_EQ(chooseCamera(kIds, "", false), 0u);
  EXPECT_EQ(chooseCamera(kIds, "046d", false), 0u);
  EXPECT_EQ(chooseCamera(kIds, "imx", false), 2u);
}

TEST(CameraChoice, AWholeIdGoesBeforeAPartOfAnother) {
  const std::vector<std::string> ids = {"usb-1:046d and more", "usb-1:046d"};
  EXPECT_EQ(chooseCamera(ids, "usb-1:046d", false), 1u);
  EXPECT_EQ(chooseCamera(ids, "usb-1:046d", true), 1u);
}

TEST(CameraChoice, OfTwoCamerasAnIdThatBothHaveIsRefusedWithTheFix) {
  EXPECT_EQ(chooseCamera(kIds, "imx", true), 2u);
  const auto both = chooseCamera(kIds, "046d", true);
  ASSERT_FALSE(both);
  EXPECT_EQ(both.error().code, "camera_absent");
  EXPECT_THAT(both.error().detail, HasSubstr("2 cameras have 046d in their ids"));
  EXPECT_THAT(both.error().detail, HasSubstr("set camera.id and camera.second to whole ids"));
}

TEST(CameraChoice, OneThatIsNotThereIsNamedBesideThoseThatAre) {
  const auto none = chooseCamera(kIds, "ov9281", true);
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().detail,
              HasSubstr("no camera with ov9281 in its id (there are: usb-1.2"));
  EXPECT_THAT(chooseCamera({}, "", false).error().detail, HasSubstr("there are: none"));
}

TEST(RestartRule, ACameraThatIsMissingForGoodDisturbsNobody) {
  RestartRule rule;
  rule.started({"video0 1", "video1 2"});
  for (int i = 0; i < 100; ++i) EXPECT_FALSE(rule.missed({"video0 1", "video1 2"}));
  for (int i = 0; i < 100; ++i) EXPECT_FALSE(rule.missed({"video0 1"}));
}

TEST(RestartRule, ANodeThatCameAndIsNotFoundForFourTriesIsLookedForAnewOnce) {
  RestartRule rule;
  rule.started({"video0 1"});
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(rule.missed({"video0 1", "video1 2"}));
  EXPECT_TRUE(rule.missed({"video0 1", "video1 2"}));
  for (int i = 0; i < 100; ++i) EXPECT_FALSE(rule.missed({"video0 1", "video1 2"}));
}

TEST(RestartRule, AFifthUnplugIsEnough) {
  RestartRule rule;
  rule.started({"video0 1"});
  for (int i = 0; i < 4; ++i) rule.unplugged();
  EXPECT_FALSE(rule.missed({"video0 1"}));
  rule.unplugged();
  EXPECT_TRUE(rule.missed({"video0 1"}));
  EXPECT_FALSE(rule.missed({"video0 1"}));
}

TEST(RestartRule, SeesVideoNodesThatMayBeOpenedAndThatOneCameAgain) {
  const std::filesystem::path folder =
      ::testing::TempDir() + "/perdure_nodes_" + std::to_string(getpid());
  std::filesystem::create_directories(folder);
  const auto make = [&](const char* name) { std::ofstream(folder / name) << "x"; };
  make("null");
  EXPECT_THAT(readableVideoNodes(folder), IsEmpty());
  make("video0");
  const auto before = readableVideoNodes(folder);
  EXPECT_THAT(before, SizeIs(1));
  std::filesystem::rename(folder / "video0", folder / "away");
  make("video0");
  const auto after = readableVideoNodes(folder);
  EXPECT_THAT(after, SizeIs(1));
  EXPECT_NE(before, after);
  EXPECT_THAT(readableVideoNodes(folder / "none"), IsEmpty());
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace perdure::capture
