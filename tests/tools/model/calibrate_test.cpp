// Tests `perdure model calibrate` on a small rendered sequence, through the service's own node.
#include "tools/model/calibrate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/base/errors.h"
#include "services/inference/model_file.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

CalibrationResult someResult() {
  CalibrationResult result;
  result.fitted = {.temperature = 1.2345, .clutter_rate = 0.7, .bias = -0.25};
  result.fitted.primed = {.floor = 0.002, .slope = 0.5, .offset = 4.0, .nothing = -0.3};
  result.has_primed = true;
  result.box_sigma = 0.05;
  result.side_insets["car"] = {0.01, 0.02, 0.03, 0.04};
  return result;
}

constexpr char kModel[] = R"({"comment": "ours", "family": "yolov8", "bins": 16,
  "input": {"width": 64, "height": 64, "fit": "resize", "colour": "rgb"},
  "classes": ["car"], "activation": {"class": "sigmoid"},
  "levels": [{"stride": 32, "tensor": "t"}]})";

TEST(CalibrationFile, WhatIsWrittenIsReadBackAndTheRestStays) {
  const auto text = withCalibration(kModel, someResult());
  const auto model = inference::parseModelDescription(text, "m.json");
  EXPECT_NEAR(model.calibration.temperature, 1.2345, 6e-4);
  EXPECT_DOUBLE_EQ(model.calibration.bias, -0.25);
  EXPECT_DOUBLE_EQ(model.calibration.clutter_rate, 0.7);
  EXPECT_DOUBLE_EQ(model.calibration.primed.floor, 0.002);
  EXPECT_DOUBLE_EQ(model.calibration.primed.slope, 0.5);
  EXPECT_DOUBLE_EQ(model.calibration.primed.nothing, -0.3);
  const auto json = nlohmann::json::parse(text);
  EXPECT_EQ(json["comment"], "ours");
  EXPECT_FALSE(json.contains("box_sigma")) << "only where the file has it";
  EXPECT_FALSE(json.contains("side_insets"));
}

TEST(CalibrationFile, BoxNoiseAndInsetsChangeWhereTheFileHasThem) {
  auto json = nlohmann::json::parse(kModel);
  json["box_sigma"] = 0.1;
  json["side_insets"] = {{"car", {0.0, 0.0, 0.0, 0.0}}};
  const auto model =
      inference::parseModelDescription(withCalibration(json.dump(), someResult()), "m.json");
  EXPECT_DOUBLE_EQ(model.box_sigma, 0.05);
  EXPECT_DOUBLE_EQ(model.side_insets.at("car")[2], 0.03);
}

TEST(CalibrationFile, WhatIsNoJsonIsRefused) {
  EXPECT_THROW(withCalibration("{", someResult()), StartupError);
}

TEST(LabelledFrames, AFolderWithoutLabelsIsToldHowToFix) {
  const fs::path folder =
      fs::temp_directory_path() / ("perdure_unlabelled_" + std::to_string(getpid()));
  fs::create_directories(folder);
  try {
    (void)readLabelled({folder, "", "", 1}, replay::ClassAliases{}, 10.0);
    FAIL() << "it was taken";
  } catch (const StartupError& e) {
    EXPECT_EQ(e.code(), ExitCode::kUnavailable);
  }
  fs::remove_all(folder);
}

}  // namespace
}  // namespace perdure::tools
