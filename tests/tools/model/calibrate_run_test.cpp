// Tests `perdure model calibrate` from rendered images to a model.json with which inference runs.
// It uses the committed network with its own calibration and with a wrong one.
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
  /// Calibrates `model` on the rendered frames and returns the new model.json.
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

  /// Returns the mean log-likelihood of a box by the frames' truth, for an unchanged model.json.
  /// Leaves it in spoiled.json.
  double likelihoodByTruth(const fs::path& frames, const nlohmann::json& model) {
    const fs::path description = folder_ / "spoiled.json";
    std::ofstream(description) << model.dump();
    const ProgramAnswer answer =
        run({"model", "calibrate", network_.string(), "--quiet", "--dry-run", "--frames",
             frames.string(), "--description", description.string()});
    EXPECT_EQ(answer.status, 0) << answer.output;
    double value = 0.0;
    const std::string& text = answer.output;
    std::istringstream(text.substr(text.find("log-likelihood") + 14)) >> value;
    return value;
  }

  const fs::path models_ = fromEnvironment("PERDURE_SOURCE") / "models";
  const fs::path network_ = models_ / "perdure_320x240.onnx";
  const fs::path folder_ =
      fs::temp_directory_path() / ("perdure-calibrate-" + std::to_string(getpid()));
  double error_before_ = 0.0;
};

TEST_F(CalibrateRun, RepairsANetworkWhoseEvidenceWasSpoiledAndInferenceTakesTheFile) {
  const auto committed = read(models_ / "model.json");
  const auto sound = calibrated(committed, "sound");
  const double sound_error = error_before_;
  auto spoiled_model = committed;
  spoiled_model["calibration"]["temperature"] = 4.0;
  spoiled_model["calibration"].erase("primed");
  const auto repaired = calibrated(spoiled_model, "spoiled");
  EXPECT_GT(error_before_, sound_error + 0.05) << "what was spoiled is seen";
  const auto &a = sound["calibration"], &b = repaired["calibration"];
  EXPECT_NEAR(a["temperature"].get<double>(), b["temperature"].get<double>(), 1e-3);
  EXPECT_NEAR(a["clutter_rate"].get<double>(), b["clutter_rate"].get<double>(), 1e-3);
  EXPECT_GT(b["temperature"].get<double>(), 0.3);
  EXPECT_LT(b["temperature"].get<double>(), 1.5);
  EXPECT_GT(b["primed"]["slope"].get<double>(), 0.0);
  EXPECT_EQ(repaired["levels"], committed["levels"]) << "the rest of the file stays";

  inference::Config config;
  config.model.path = network_.string();
  config.model.description = (folder_ / "spoiled.new.json").string();
  const inference::Node node(config, 1);
  EXPECT_NEAR(node.description().calibration.temperature, b["temperature"].get<double>(), 1e-9);
}

/// Calibrates an overconfident network on frames without labels: the map of a run replaces the
/// labels. The result is scored with the frames' truth.
TEST_F(CalibrateRun, TheMapOfARunStandsInForLabels) {
  const fs::path street = folder_ / "street", out = folder_ / "out";
  const ProgramAnswer drawn =
      run({"simulate", "--scene", "street", "--seed", "3", "--seconds", "12", "--rate", "10",
           "--size", "320x240", "--quiet", "--out", street.string()});
  ASSERT_EQ(drawn.status, 0) << drawn.output;
  auto spoiled = read(models_ / "model.json");
  spoiled["calibration"] = {{"temperature", 0.2}, {"clutter_rate", 0.5}};
  const double before = likelihoodByTruth(street, spoiled);
  const fs::path description = folder_ / "spoiled.json", repaired = folder_ / "repaired.json";
  const ProgramAnswer mapped =
      run({"pipeline", "--quiet", "--data", street.string(), "--odometry", "truth", "--detections",
           "model", "--model", network_.string(), "--out", out.string(), "--set",
           "inference.model.description=" + description.string()});
  ASSERT_EQ(mapped.status, 0) << mapped.output;
  const ProgramAnswer fitted = run({"model", "calibrate", network_.string(), "--quiet", "--frames",
                                    street.string(), "--labels", out.string(), "--description",
                                    description.string(), "--out", repaired.string()});
  ASSERT_EQ(fitted.status, 0) << fitted.output;
  const auto model = read(repaired);
  EXPECT_GT(likelihoodByTruth(street, model), 0.8 * before) << "nats a box, below 0: " << before;
  EXPECT_EQ(model.value("box_sigma", 0.0), spoiled.value("box_sigma", 0.0))
      << "the sides of the map's boxes are no measure of a network's";
}

/// The run has frames with the same stamps but with other objects.
TEST_F(CalibrateRun, LabelsOfOtherFramesAreRefused) {
  const fs::path frames = folder_ / "frames", out = folder_ / "other";
  fs::create_directories(out);
  std::ofstream rows(out / "objects_final.csv"), poses(out / "trajectory.tum");
  rows << "sequence,frame,timestamp_ns,object_id,class,score,x,y,z,l,w,h,yaw,visible\n";
  std::ifstream index(frames / "mav0/cam0/data.csv");
  std::string line;
  for (int i = -1; std::getline(index, line); ++i) {
    if (i < 0) continue;  // the header
    const std::string stamp = line.substr(0, line.find(','));
    rows << "s," << i << "," << stamp << ",1,car,0.99,9,0,0,4,1.7,1.5,0,1\n";
    poses << std::fixed << std::stod(stamp) * 1e-9 << " 0 0 0 0 0 0 1\n";
  }
  rows.close(), poses.close();
  const auto refused = [&](const fs::path& labels) {
    return run({"model", "calibrate", network_.string(), "--quiet", "--dry-run", "--frames",
                frames.string(), "--labels", labels.string()});
  };
  const ProgramAnswer other = refused(out);
  EXPECT_EQ(other.status, 69) << other.output;
  EXPECT_NE(other.output.find("is it a run over these frames"), std::string::npos) << other.output;
  const ProgramAnswer none = refused(folder_ / "nothere");
  EXPECT_EQ(none.status, 69) << none.output;
  EXPECT_NE(none.output.find("leave out --labels for its own truth"), std::string::npos);
}

}  // namespace
}  // namespace perdure::tools
