#include "services/inference/model_heads.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "services/inference/core/network/tensors.h"

namespace perdure::inference {

std::vector<std::string> linesOf(const ListFile& list, JsonReader& reader) {
  namespace fs = std::filesystem;
  std::vector<std::string> lines;
  std::error_code error;
  // Only regular files are read, because devices and pipes may have no end.
  const bool regular = fs::is_regular_file(list.path, error);
  const auto bytes = regular ? fs::file_size(list.path, error) : 0;
  if (!error && bytes > list.most_bytes) {
    reader.complain(list.key, list.path.string() + " is larger than " +
                                  std::to_string(list.most_bytes >> 20U) +
                                  " MiB; name a file with " + list.what + ", one a line");
    return {};
  }
  std::ifstream in;
  if (regular && !error) in.open(list.path);
  for (std::string line; std::getline(in, line);) {
    // Removes a byte-order mark.
    if (lines.empty() && line.starts_with("\xEF\xBB\xBF")) line.erase(0, 3);
    while (!line.empty() && std::isspace(static_cast<unsigned char>(line.back()))) line.pop_back();
    if (!line.empty()) lines.push_back(line);
  }
  if (lines.empty()) {
    reader.complain(list.key, list.path.string() + " is missing or holds no " + list.what);
  }
  return lines;
}

namespace {

constexpr std::uintmax_t kMostPriorBytes = 16U << 20U;  // room for 300,000 priors

void readAzimuth(const Json& json, JsonReader& parent, ModelDescription& model) {
  JsonReader reader(json, "azimuth.", parent.problems());
  reader.positiveInteger("bins", model.azimuth.bins);
  reader.number("sigma", model.azimuth.sigma, 0.001, 3.2);
  model.azimuth.classes = model.classes;
  if (const Json* classes = reader.find("classes")) {
    model.azimuth.classes.clear();
    for (const Json& name : *classes) {
      const std::string text = name.is_string() ? name.get<std::string>() : "";
      const auto& known = model.classes;
      if (std::find(known.begin(), known.end(), text) == known.end()) {
        reader.complain("classes", "\"" + text + "\" is not one of the model's classes");
      }
      model.azimuth.classes.push_back(text);
    }
  }
  reader.rejectUnknown();
}

bool answersWhole(Family family) {
  return family == Family::kYolov5 || family == Family::kYolov8 || family == Family::kNanoDet ||
         family == Family::kSsd || family == Family::kDetr;
}

void readActivation(const Json& json, JsonReader& parent, ModelDescription& model) {
  JsonReader reader(json, "activation.", parent.problems());
  reader.choice<bool>("class", model.class_softmax, {{"sigmoid", false}, {"softmax", true}});
  if (answersWhole(model.family)) reader.flag("applied", model.applied);
  if (model.family == Family::kSsd || model.family == Family::kDetr) {
    const auto usual = model.class_softmax ? Background::kLast : Background::kNone;
    model.background = model.family == Family::kSsd ? Background::kFirst : usual;
    reader.choice<Background>(
        "background", model.background,
        {{"none", Background::kNone}, {"first", Background::kFirst}, {"last", Background::kLast}},
        false);
  }
  if (!model.class_softmax || model.background == Background::kNone) {
    reader.number("objectness_exponent", model.objectness_exponent, 0.01, 10);
    reader.number("class_exponent", model.class_exponent, 0.01, 10);
  }
  reader.rejectUnknown();
}

void readOutputs(const Json& json, JsonReader& parent, ModelDescription& model) {
  JsonReader reader(json, "outputs.", parent.problems());
  const bool parts = model.family == Family::kSsd || model.family == Family::kDetr ||
                     (model.family == Family::kYolov8 && reader.find("predictions") == nullptr);
  if (parts) {
    model.outputs.boxes = reader.text("boxes", true);
    model.outputs.scores = reader.text("scores", true);
  } else {
    model.outputs.predictions = reader.text("predictions", true);
  }
  reader.rejectUnknown();
}

/// Reads one prior per line: x and y of its centre, width and height, as shares of the input's
/// sides.
void readPriors(JsonReader& reader, const std::string& file, BoxForm& form) {
  const std::string name = reader.text("priors_file", true);
  if (name.empty()) return;
  const auto path = std::filesystem::path(file).parent_path() / name;
  const auto lines = linesOf({"priors_file", path, "priors", kMostPriorBytes}, reader);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    std::istringstream words(lines[i]);
    std::array<double, 4> prior{};
    std::string rest;
    const bool read = static_cast<bool>(words >> prior[0] >> prior[1] >> prior[2] >> prior[3]);
    if (!read || words >> rest || !(prior[2] > 0 && prior[3] > 0)) {
      return reader.complain("priors_file", path.string() + ", line " + std::to_string(i + 1) +
                                                ": is not \"x y width height\" in shares");
    }
    form.priors.push_back(prior);
  }
}

void readBoxes(const Json& json, JsonReader& parent, const std::string& file, BoxForm& form) {
  JsonReader reader(json, "boxes.", parent.problems());
  using Kind = BoxForm::Kind;
  reader.choice<Kind>(
      "form", form.kind,
      {{"centre", Kind::kCentre}, {"corners", Kind::kCorners}, {"offsets", Kind::kOffsets}}, false);
  reader.flag("y_first", form.y_first);
  if (form.kind == Kind::kOffsets) {
    form.shares = true;
    readPriors(reader, file, form);
    if (const Json* variances = reader.find("variances")) {
      const auto numbers = numbersOf(*variances);
      if (numbers.size() == 2 && numbers[0] > 0 && numbers[1] > 0) {
        form.variances = {numbers[0], numbers[1]};
      } else {
        reader.complain("variances", "is not a list of two numbers above 0: of centre and size");
      }
    }
  } else {
    reader.choice<bool>("unit", form.shares, {{"shares", true}, {"pixels", false}}, false);
  }
  reader.rejectUnknown();
}

std::vector<std::pair<double, double>> anchorsOf(JsonReader& reader) {
  std::vector<std::pair<double, double>> found;
  const Json* anchors = reader.need("anchors");
  for (std::size_t i = 0; anchors && anchors->is_array() && i < anchors->size(); ++i) {
    const auto pair = numbersOf((*anchors)[i]);
    if (pair.size() == 2 && pair[0] > 0 && pair[1] > 0) {
      found.emplace_back(pair[0], pair[1]);
    } else {
      reader.complain("anchors", "holds something that is not [width, height]");
    }
  }
  if (anchors && found.empty()) reader.complain("anchors", "is empty");
  return found;
}

void readTensors(JsonReader& reader, const ModelDescription& model, Level& level) {
  if (model.family == Family::kYolov8 || model.family == Family::kNanoDet) {
    level.tensor = reader.text("tensor", false);
  }
  for (const LevelTensor& tensor : levelTensors(model, level)) {
    level.*tensor.name = reader.text(tensor.key, true);
  }
  if (model.family == Family::kYoloFastest || model.family == Family::kYolov5 ||
      model.family == Family::kYoloFastestV2) {
    level.anchors = anchorsOf(reader);
  }
}

void readLevel(const Json& json, const std::string& where, JsonReader& parent,
               ModelDescription& model) {
  JsonReader reader(json, where, parent.problems());
  Level level;
  reader.positiveInteger("stride", level.stride);
  const bool reaches = model.family == Family::kPerdure || model.family == Family::kNanoDet;
  if (level.stride > 0 && !reaches &&
      (model.input.width % level.stride != 0 || model.input.height % level.stride != 0)) {
    reader.complain("stride", "does not divide the input's width and height");
  }
  if (!model.outputs.any()) readTensors(reader, model, level);
  reader.rejectUnknown();
  model.levels.push_back(level);
}

void readLevels(JsonReader& reader, ModelDescription& model) {
  const Json* levels = reader.need("levels");
  if (!levels) return;
  for (std::size_t i = 0; levels->is_array() && i < levels->size(); ++i) {
    readLevel((*levels)[i], "levels[" + std::to_string(i) + "].", reader, model);
  }
  if (model.levels.empty()) reader.complain("levels", "is empty");
}

void readWhole(JsonReader& reader, const std::string& file, ModelDescription& model) {
  const bool needed = model.family == Family::kSsd || model.family == Family::kDetr;
  const Json* outputs = needed ? reader.need("outputs") : reader.find("outputs");
  if (outputs) readOutputs(*outputs, reader, model);
  if (!outputs || model.family == Family::kNanoDet) return;
  model.box_form.kind =
      model.family == Family::kSsd ? BoxForm::Kind::kCorners : BoxForm::Kind::kCentre;
  model.box_form.shares = needed;
  if (const Json* boxes = reader.find("boxes")) readBoxes(*boxes, reader, file, model.box_form);
}

}  // namespace

void readHeads(JsonReader& reader, const std::string& file, ModelDescription& model) {
  const bool distances = model.family == Family::kYolov8 || model.family == Family::kNanoDet;
  if (model.family == Family::kPerdure) {
    model.class_softmax = true;  // soft-max over background and classes; not configurable
    model.background = Background::kFirst;
    if (const Json* azimuth = reader.find("azimuth")) readAzimuth(*azimuth, reader, model);
    reader.number("reach", model.reach, 0, 10);
    reader.number("spread_scale", model.spread_scale, 0, 100);
  } else if (const Json* activation = reader.need("activation")) {
    readActivation(*activation, reader, model);
  }
  if (answersWhole(model.family)) readWhole(reader, file, model);
  const bool whole_boxes = model.outputs.any() && model.family != Family::kNanoDet;
  if (distances && !whole_boxes) {
    model.bins = model.family == Family::kNanoDet ? 8 : 16;
    model.cell_offset = model.family == Family::kNanoDet ? 0.0 : 0.5;
    reader.integer("bins", model.bins, 1, 64);
    reader.number("cell_offset", model.cell_offset, 0, 1);
    if (model.bins == 1) {
      reader.choice<bool>("distances", model.exponents, {{"linear", false}, {"exp", true}}, false);
    }
  }
  const bool needs_outputs = model.family == Family::kSsd || model.family == Family::kDetr;
  if (!whole_boxes && !needs_outputs) readLevels(reader, model);
}

}  // namespace perdure::inference
