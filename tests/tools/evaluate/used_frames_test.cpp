#include "tools/evaluate/used_frames.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>

#include "tests/common/replay/tiny_datasets.h"
#include "tools/perdure/commands.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using replay::startupErrorOf;
using replay::writeText;
using ::testing::HasSubstr;

fs::path reported(const std::string& name, const std::string& frames) {
  const auto run = replay::freshFolder(name);
  writeText(run / "report.json", R"({"frames": )" + frames + "}");
  return run;
}

TEST(UsedFrames, AreReadBackAsTheyWereKept) {
  for (const auto& frames :
       std::vector<UsedFrames>{{}, {4}, {0, 3, 6, 9}, {0, 1, 2, 5, 7, 9, 20}}) {
    const auto run = reported("used_frames", framesToJson(frames).dump());
    EXPECT_EQ(usedFramesOf(run), frames) << framesToJson(frames);
  }
  EXPECT_EQ(framesToJson({0, 3, 6, 9}).dump(), R"({"used":4,"runs":[[0,9,3]]})");
  EXPECT_EQ(strideOf({0, 3, 6, 9}), 3.0);
}

TEST(UsedFrames, AreNotKnownWhereNobodyTells) {
  EXPECT_FALSE(usedFramesOf(replay::freshFolder("used_none")));
  const auto run = replay::freshFolder("used_other");
  writeText(run / "report.json", R"({"every": 2})");
  EXPECT_FALSE(usedFramesOf(run));
}

TEST(UsedFrames, ThatCannotBeAreRefused) {
  for (const char* wrong : {"3", R"({"runs": 3})", R"({"runs": [[0, 9]]})",
                            R"({"runs": [[9, 0, 1]]})", R"({"runs": [[0, 9, 0]]})",
                            R"({"runs": [[0, 9999999999999, 1]]})", R"({"runs": [[0, -1, 1]]})"}) {
    const auto run = reported("used_wrong", wrong);
    EXPECT_THAT(startupErrorOf([&] { usedFramesOf(run); }), HasSubstr("run perdure pipeline again"))
        << wrong;
  }
}

TEST(UsedFrames, WithoutAPoseAreThoseBetweenPoses) {
  const auto at = [](int ms) { return TimePoint(std::chrono::milliseconds(ms)); };
  const std::vector<replay::StampedPose> poses{{at(100), {}}, {at(200), {}}, {at(400), {}}};
  EXPECT_EQ(withoutPose({at(0), at(50), at(500)}, poses), 0u) << "before and after";
  EXPECT_EQ(withoutPose({at(100), at(150), at(201), at(300), at(399)}, poses), 2u);
  EXPECT_EQ(withoutPose({at(100)}, {}), 0u);
  EXPECT_THAT(noteOfUntold(2), HasSubstr("2 frames between poses have none"));
}

/// Runs `perdure evaluate trajectory` on poses at the first, third and fifth of five frames.
nlohmann::json judged(const fs::path& run, const fs::path& drive) {
  std::string tum;
  for (int i = 0; i < 5; i += 2) {
    tum += std::to_string(1.0 + 0.05 * i) + " " + std::to_string(i) + " 0 0 0 0 0 1\n";
  }
  writeText(run / "trajectory.tum", tum);
  CLI::App app;
  setUpEvaluate(app);
  ::testing::internal::CaptureStdout();
  app.parse("trajectory " + (run / "trajectory.tum").string() + " --truth " +
            drive.string() + " --json");
  std::fflush(stdout);
  return nlohmann::json::parse(::testing::internal::GetCapturedStdout());
}

TEST(EvaluateCommand, NamesItsOwnOptionWhereATrajectoryIsMissing) {
  const auto run = replay::freshFolder("no_trajectory");
  const auto error = [&](const std::string& line) {
    CLI::App app;
    setUpEvaluate(app);
    return startupErrorOf([&] { app.parse(line); });
  };
  const std::string tum = (run / "trajectory.tum").string();
  EXPECT_THAT(error("trajectory " + tum + " --truth " + tum), HasSubstr("--truth takes"));
  writeText(run / "truth.tum", "0 0 0 0 0 0 0 1\n");
  EXPECT_THAT(error("trajectory " + tum + " --truth " + (run / "truth.tum").string()),
              HasSubstr("`perdure pipeline` writes"));
}

TEST(UsedFrames, AloneAreExpectedToHaveAPose) {
  const auto drive = replay::tinyEuroc("used_drive");
  writeText(drive / "mav0/state_groundtruth_estimate0/data.csv",
            "#timestamp, p, q w x y z, v, b_w, b_a\n"
            "990000000,0,0,0,1,0,0,0,0,0,0,0,0,0,0,0,0\n"
            "1290000000,6,0,0,1,0,0,0,0,0,0,0,0,0,0,0,0\n");
  const auto all = judged(replay::freshFolder("used_all"), drive);
  EXPECT_EQ(all["frames_expected"], 5);
  EXPECT_EQ(all["frames_left_out"], 0);
  EXPECT_EQ(all["frames_untold"], 2) << "left out or missed";
  const auto second = judged(reported("used_second", R"({"used": 3, "runs": [[0, 4, 2]]})"), drive);
  EXPECT_EQ(second["frames_expected"], 3);
  EXPECT_EQ(second["frames_left_out"], 2);
  EXPECT_EQ(second["frames_untold"], 0);
  EXPECT_EQ(second["coverage"], 1.0);
  const auto other =
      judged(reported("used_of_other", R"({"used": 2, "runs": [[1, 3, 2]]})"), drive);
  EXPECT_EQ(other["frames_expected"], 5) << "those are frames of other data";
}

}  // namespace
}  // namespace perdure::tools
