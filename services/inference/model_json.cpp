#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <set>

#include "common/base/errors.h"
#include "services/inference/json_reader.h"
#include "services/inference/model_file.h"
#include "services/inference/model_heads.h"

namespace perdure::inference {
namespace {

constexpr double kMostInset = 0.45;
constexpr std::uintmax_t kMostClassBytes = 1U << 20U;

/// Reads `scale`: one number, or one for each channel.
void readScale(JsonReader& reader, Input& input) {
  const Json* scale = reader.find("scale");
  if (!scale) return;
  auto numbers =
      scale->is_number() ? std::vector<double>(3, scale->get<double>()) : numbersOf(*scale);
  const auto good = [](double x) { return x >= 1e-6 && x <= 1e6; };
  if (numbers.size() != 3 || !std::all_of(numbers.begin(), numbers.end(), good)) {
    return reader.complain("scale", "is not a number in [0.000001, 1000000], nor a list of three");
  }
  std::copy(numbers.begin(), numbers.end(), input.scale.begin());
}

void readInput(const Json& json, JsonReader& parent, Input& input) {
  JsonReader reader(json, "input.", parent.problems());
  reader.positiveInteger("width", input.width);
  reader.positiveInteger("height", input.height);
  reader.choice<Fit>("fit", input.fit,
                     {{"letterbox_top_left", Fit::kLetterboxTopLeft},
                      {"letterbox_centre", Fit::kLetterboxCentre},
                      {"resize", Fit::kResize}});
  reader.choice<bool>("colour", input.rgb, {{"bgr", false}, {"rgb", true}});
  reader.number("pad", input.pad, 0, 255);
  readScale(reader, input);
  if (const Json* mean = reader.find("mean")) {
    input.mean = numbersOf(*mean);
    if (input.mean.size() != 3) {
      reader.complain("mean", "is not a list of three numbers");
      input.mean = {0, 0, 0};
    }
  }
  reader.rejectUnknown();
}

void readClasses(JsonReader& reader, const std::string& file, ModelDescription& model) {
  const Json* classes = reader.find("classes");
  const std::string beside = reader.text("classes_file", classes == nullptr);
  if (classes) {
    for (const Json& name : *classes) {
      if (name.is_string()) model.classes.push_back(name.get<std::string>());
    }
    if (!classes->is_array() || model.classes.size() != classes->size()) {
      reader.complain("classes", "is not a list of names");
    }
  } else if (!beside.empty()) {
    const auto path = std::filesystem::path(file).parent_path() / beside;
    model.classes = linesOf({"classes_file", path, "names", kMostClassBytes}, reader);
  }
  std::set<std::string> seen;
  for (std::string& name : model.classes) {
    std::transform(name.begin(), name.end(), name.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (!seen.insert(name).second) reader.complain("classes", "\"" + name + "\" is there twice");
  }
}

void readInsets(const Json& json, JsonReader& reader, ModelDescription& model) {
  if (!json.is_object()) return reader.complain("side_insets", "is not an object by class");
  for (const auto& [name, sides] : json.items()) {
    const auto& known = model.classes;
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      reader.complain("side_insets", "\"" + name + "\" is not one of the model's classes");
      continue;
    }
    const auto inset = [](const Json& x) {
      return x.is_number() && std::abs(x.get<double>()) <= kMostInset;
    };
    if (!sides.is_array() || sides.size() != 4 || !std::all_of(sides.begin(), sides.end(), inset)) {
      reader.complain("side_insets", "\"" + name + "\" has not four numbers in [-0.45, 0.45]");
      continue;
    }
    model.side_insets[name] = sides.get<std::array<double, 4>>();
  }
}

void readPrimed(const Json& json, JsonReader& parent, PrimedCalibration& primed) {
  JsonReader reader(json, "calibration.primed.", parent.problems());
  reader.number("floor", primed.floor, 1e-6, 0.5);
  reader.number("slope", primed.slope, 0, 10);
  reader.number("offset", primed.offset, -20, 20);
  reader.number("nothing", primed.nothing, -20, 0);
  reader.rejectUnknown();
}

void readCalibration(const Json& json, JsonReader& parent, Calibration& calibration) {
  JsonReader reader(json, "calibration.", parent.problems());
  reader.number("temperature", calibration.temperature, 0.01, 100);
  reader.number("bias", calibration.bias, -20, 20);
  reader.number("clutter_rate", calibration.clutter_rate, 1e-6, 1 - 1e-6);
  if (const Json* primed = reader.find("primed")) readPrimed(*primed, reader, calibration.primed);
  reader.rejectUnknown();
}

void readAll(JsonReader& reader, const std::string& file, ModelDescription& model) {
  model.name = reader.text("name", false);
  model.digest = reader.text("digest", false);
  reader.choice<Family>("family", model.family,
                        {{"yolox", Family::kYolox},
                         {"yolo-fastest", Family::kYoloFastest},
                         {"fastestdet", Family::kFastestDet},
                         {"perdure", Family::kPerdure},
                         {"yolov5", Family::kYolov5},
                         {"yolov7", Family::kYolov5},
                         {"yolov8", Family::kYolov8},
                         {"rtmdet", Family::kYolov8},
                         {"nanodet", Family::kNanoDet},
                         {"picodet", Family::kNanoDet},
                         {"yolo-fastestv2", Family::kYoloFastestV2},
                         {"ssd", Family::kSsd},
                         {"detr", Family::kDetr}});
  if (const Json* input = reader.need("input")) readInput(*input, reader, model.input);
  readClasses(reader, file, model);
  readHeads(reader, file, model);
  reader.choice<bool>("backend", model.for_onnx_runtime, {{"auto", false}, {"onnxruntime", true}},
                      false);
  reader.number("box_sigma", model.box_sigma, 0, 1);
  reader.choice<BoxExtent>("box_extent", model.boxes,
                           {{"cuboid", BoxExtent::kCuboid},
                            {"outline", BoxExtent::kOutline},
                            {"unknown", BoxExtent::kUnknown}},
                           false);
  reader.flag("upright", model.upright);
  if (const Json* insets = reader.find("side_insets")) readInsets(*insets, reader, model);
  if (const Json* calibration = reader.find("calibration")) {
    readCalibration(*calibration, reader, model.calibration);
  }
  reader.find("comment");
  reader.rejectUnknown();
}

}  // namespace

ModelDescription parseModelDescription(const std::string& text, const std::string& file) {
  std::vector<std::string> problems;
  ModelDescription model;
  try {
    const Json json = Json::parse(text);
    JsonReader reader(json, "", problems);
    if (problems.empty()) readAll(reader, file, model);
  } catch (const Json::exception& e) {
    problems.emplace_back(e.what());
  }
  if (problems.empty()) return model;
  std::string message;
  for (const std::string& problem : problems) {
    message += (message.empty() ? "" : "\n") + file + ": " + problem;
  }
  throw StartupError(ExitCode::kConfiguration,
                     message + "\nThe keys are explained in services/inference/model_json.md.");
}

}  // namespace perdure::inference
