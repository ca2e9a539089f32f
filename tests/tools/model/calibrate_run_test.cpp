// `perdure model calibrate` from rendered pictures to a model.json that inference runs with: the
// committed network, and the same one with its evidence spoiled.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/base/subprocess.h"
#include "services/inference/node.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

fs::path fromEnvironment(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

class CalibrateRun : public testing::Test {
 protected:
  void SetUp() override {
    if (fromEnvironment("PERDURE_BIN").empty()) GTEST_SKIP() << "run by ctest";
    fs::create_directories(folder_);
    const ProgramAnswer made =
        run({"simulate", "--scene", "random", "--seed", "880001", "--seconds", "40", "--rate", "1",
             "--quiet", "--out", (folder_ / "frames").string()});
    ASSERT_EQ(made.status, 0) << made.output;
  }
  void TearDown() override { fs::remove_all(folder_); }

  static ProgramAnswer run(std::vector<std::string> command) {
    command.insert(command.begin(), (fromEnvironment("PERDURE_BIN") / "perdure").string());
    return runProgram({.command = std::move(command)});
  }
  static nlohmann::json read(const fs::path& file) {
    return nlohmann::json::parse(std::ifstream(file));
  }
  /// The model.json that a calibration of `model` on the rendered frames writes.
  nlohmann::json calibrated(const nlohmann::json& model, const std::string& name) {
    const fs::path description = folder_ / (name + ".json"), out = folder_ / (name + ".new.json");
    std::ofstream(description) << model.dump();
    const ProgramAnswer answer = run({"model", "calibrate", network_.string(), "--quiet",
                                      "--frames", (folder_ / "frames").string(), "--description",
                                      description.string(), "--out", out.string()});
    EXPECT_EQ(answer.status, 0) << answer.output;
    const std::string& text = answer.output;
    std::istringstream(text.substr(text.find("calibration error") + 17)) >> error_before_;
    return read(out);
  }

  const fs::path models_ = fromEnvironment("PERDURE_SOURCE") / "models";
  const fs::path network_ = models_ / "perdure_320x240.onnx";
  const fs::path folder_ =
      fs::temp_directory_path() / ("perdure-calibrate-" + std::to_string(getpid()));
  double error_before_ = 0.0;
};

TEST_F(CalibrateRun, MendsANetworkWhoseEvidenceWasSpoiledAndInferenceTakesTheFile) {
  const auto committed = read(models_ / "model.json");
  const auto sound = calibrated(committed, "sound");
  const double sound_error = error_before_;
  auto spoiled_model = committed;
  spoiled_model["calibration"]["temperature"] = 4.0;
  spoiled_model["calibration"].erase("primed");
  const auto mended = calibrated(spoiled_model, "spoiled");
  EXPECT_GT(error_before_, sound_error + 0.05) << "what was spoiled is seen";
  const auto &a = sound["calibration"], &b = mended["calibration"];
  EXPECT_NEAR(a["temperature"].get<double>(), b["temperature"].get<double>(), 1e-3);
  EXPECT_NEAR(a["clutter_rate"].get<double>(), b["clutter_rate"].get<double>(), 1e-3);
  EXPECT_GT(b["temperature"].get<double>(), 0.3);
  EXPECT_LT(b["temperature"].get<double>(), 1.5);
  EXPECT_GT(b["primed"]["slope"].get<double>(), 0.0);
  EXPECT_EQ(mended["levels"], committed["levels"]) << "the rest of the file stays";

  inference::Config config;
  config.model.path = network_.string();
  config.model.description = (folder_ / "spoiled.new.json").string();
  const inference::Node node(config, 1);
  EXPECT_NEAR(node.description().calibration.temperature, b["temperature"].get<double>(), 1e-9);
}

}  // namespace
}  // namespace perdure::tools
