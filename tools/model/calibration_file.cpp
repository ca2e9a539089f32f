// Writes the fitted values to model.json, and draws the reliability diagram.
#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "common/base/errors.h"
#include "tools/model/calibrate.h"
#include "tools/outputs/pictures/chart.h"

namespace perdure::tools {
namespace {

using Json = nlohmann::ordered_json;

double rounded(double value) { return std::round(value * 1000.0) / 1000.0; }

std::vector<cv::Point2d> curveOf(const Reliability& reliability) {
  constexpr std::size_t kFew = 10;  // boxes; a share of fewer is not significant
  std::vector<cv::Point2d> points;
  for (const auto& bin : reliability.bins) {
    if (bin.count >= kFew) points.emplace_back(bin.confidence, bin.right);
  }
  return points;
}

}  // namespace

std::string withCalibration(const std::string& model_json, const CalibrationResult& result) {
  Json json;
  try {
    json = Json::parse(model_json);
  } catch (const Json::exception& e) {
    throw StartupError(ExitCode::kConfiguration, std::string("model.json: ") + e.what());
  }
  const auto& fitted = result.fitted;
  Json calibration = {{"temperature", rounded(fitted.temperature)},
                      {"clutter_rate", rounded(fitted.clutter_rate)}};
  if (fitted.bias != 0.0) calibration["bias"] = rounded(fitted.bias);
  if (result.has_primed) {
    const auto& primed = fitted.primed;
    calibration["primed"] = {{"floor", primed.floor},
                             {"slope", rounded(primed.slope)},
                             {"offset", rounded(primed.offset)},
                             {"nothing", rounded(primed.nothing)}};
  }
  json["calibration"] = calibration;
  if (json.contains("box_sigma") && result.box_sigma > 0.0) {
    json["box_sigma"] = rounded(result.box_sigma);
  }
  if (json.contains("side_insets")) {
    for (const auto& [name, sides] : result.side_insets) {
      json["side_insets"][name] = {rounded(sides[0]), rounded(sides[1]), rounded(sides[2]),
                                   rounded(sides[3])};
    }
  }
  return json.dump(2) + "\n";
}

void drawReliability(const CalibrationResult& result, const std::filesystem::path& file) {
  const Colour before(60, 130, 230), after(170, 110, 30);
  cv::Mat picture(560, 640, CV_8UC3, kPaper);
  Chart chart(picture, {60, 40, 540, 460}, {0.0, 1.0}, {0.0, 1.0});
  chart.drawGrid(true);
  chart.drawCurve({{0.0, 0.0}, {1.0, 1.0}}, {.colour = kInk, .dashed = true});
  chart.drawCurve(curveOf(result.reliability_before), {.colour = before, .thickness = 2});
  chart.drawCurve(curveOf(result.reliability_after), {.colour = after, .thickness = 2});
  drawText(picture, "share of boxes that were right, by what they said", {60, 26}, kInk);
  drawText(picture, "before", {80, 70}, before);
  drawText(picture, "after, on frames held out", {80, 92}, after);
  drawText(picture, "probability of the best class", {60, 546}, kInk);
  if (!cv::imwrite(file.string(), picture)) {
    throw StartupError(ExitCode::kUnavailable,
                       file.string() + " cannot be written; give --drawing a .png elsewhere");
  }
}

}  // namespace perdure::tools
