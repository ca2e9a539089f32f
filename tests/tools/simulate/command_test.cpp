// Tests the command line of `perdure simulate`.
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>

#include "common/base/errors.h"
#include "common/sim/scene.h"
#include "tools/perdure/commands.h"

namespace perdure::tools {
namespace {

ExitCode exitOf(const std::string& arguments) {
  CLI::App app("perdure");
  setUpSimulate(app);
  try {
    app.parse(arguments);
  } catch (const StartupError& error) {
    return error.code();
  } catch (const CLI::ParseError& error) {
    return ExitCode::kUsage;
  }
  return ExitCode::kOk;
}

TEST(SimulateCommand, ListsEverySceneWithWhatItProves) {
  testing::internal::CaptureStdout();
  EXPECT_EQ(exitOf("--list"), ExitCode::kOk);
  const std::string output = testing::internal::GetCapturedStdout();
  ASSERT_FALSE(sim::sceneNames().empty());
  for (const auto& scene : sim::sceneNames()) {
    EXPECT_NE(output.find(scene.name), std::string::npos);
    EXPECT_NE(output.find(scene.proves), std::string::npos);
  }
}

TEST(SimulateCommand, RefusesWhatMakesNoSenseAndWritesNothing) {
  const auto out = std::filesystem::path(testing::TempDir()) / "perdure_simulate_command";
  std::filesystem::remove_all(out);
  const std::string to_out = " --out " + out.string();
  for (const std::string arguments :
       {"--scene moon", "--scene room --size 640", "--scene room --size 640x",
        "--scene room --size 640x480x3", "--scene room --size 8x8", "--scene room --seconds 0",
        "--scene room --seconds -1", "--scene room --rate 0", "--scene room --every 0",
        "--scene room --encoding bmp", "--scene room --look-set mine", "--scene room --threads 0",
        "--seed 7"}) {
    EXPECT_EQ(exitOf(arguments + to_out), ExitCode::kUsage) << arguments;
    EXPECT_FALSE(std::filesystem::exists(out)) << arguments;
  }
  EXPECT_EQ(exitOf("--scene room"), ExitCode::kUsage) << "without --out";
}

}  // namespace
}  // namespace perdure::tools
