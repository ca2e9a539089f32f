// Writes the fitted values to model.json.
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/errors.h"
#include "tools/model/calibrate.h"

namespace perdure::tools {
namespace {

using Json = nlohmann::ordered_json;

double rounded(double value) { return std::round(value * 1000.0) / 1000.0; }

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

}  // namespace perdure::tools
