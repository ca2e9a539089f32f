#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "common/base/errors.h"
#include "services/inference/model_file.h"

namespace perdure::inference {
namespace {

constexpr double kMostInset = 0.45;

using Json = nlohmann::json;

/// Reads one JSON object and remembers all that is wrong with it, unknown keys included.
class Reader {
 public:
  Reader(const Json& json, std::string where, std::vector<std::string>& problems)
      : json_(json), where_(std::move(where)), problems_(problems) {
    if (!json_.is_object()) complain("", "is not an object");
  }

  void complain(const std::string& key, const std::string& what) {
    problems_.push_back(where_ + key + ": " + what);
  }

  const Json* find(const std::string& key) {
    known_.insert(key);
    const auto it = json_.find(key);
    return it == json_.end() ? nullptr : &*it;
  }

  const Json* need(const std::string& key) {
    const Json* value = find(key);
    if (!value) complain(key, "is missing");
    return value;
  }

  void number(const std::string& key, double& target, double low, double high) {
    const Json* value = find(key);
    if (!value) return;
    const double number = value->is_number() ? value->get<double>() : NAN;
    if (!(number >= low && number <= high)) {
      return complain(key, "is not a number in [" + shorten(low) + ", " + shorten(high) + "]");
    }
    target = number;
  }

  void positiveInteger(const std::string& key, int& target) {
    const Json* value = need(key);
    if (!value) return;
    if (!value->is_number_integer() || value->get<std::int64_t>() < 1 ||
        value->get<std::int64_t>() > 8192) {
      return complain(key, "is not an integer from 1 to 8192");
    }
    target = value->get<int>();
  }

  std::string text(const std::string& key, bool required) {
    const Json* value = required ? need(key) : find(key);
    if (!value) return {};
    if (value->is_string() && !value->get<std::string>().empty()) return value->get<std::string>();
    complain(key, "is not a text");
    return {};
  }

  template <class T>
  void choice(const std::string& key, T& target, const std::map<std::string, T>& values) {
    const std::string name = text(key, true);
    const auto it = values.find(name);
    if (it != values.end()) {
      target = it->second;
    } else if (!name.empty()) {
      std::string known;
      for (const auto& [word, value] : values) known += (known.empty() ? "" : ", ") + word;
      complain(key, "\"" + name + "\" is not one of " + known);
    }
  }

  void rejectUnknown() {
    if (!json_.is_object()) return;
    for (const auto& [key, value] : json_.items()) {
      if (!known_.contains(key)) complain(key, "is not a known key");
    }
  }

  std::string where() const { return where_; }
  std::vector<std::string>& problems() { return problems_; }

 private:
  static std::string shorten(double value) {
    std::string text = std::to_string(value);
    text.erase(text.find_last_not_of('0') + 1);
    if (text.back() == '.') text.pop_back();
    return text;
  }

  const Json& json_;
  std::string where_;
  std::vector<std::string>& problems_;
  std::set<std::string> known_;
};

std::vector<double> numbersOf(const Json& json) {
  std::vector<double> numbers;
  if (!json.is_array()) return {};
  for (const Json& value : json) {
    if (!value.is_number()) return {};
    numbers.push_back(value.get<double>());
  }
  return numbers;
}

void readInput(const Json& json, Reader& parent, Input& input) {
  Reader reader(json, "input.", parent.problems());
  reader.positiveInteger("width", input.width);
  reader.positiveInteger("height", input.height);
  reader.choice<Fit>("fit", input.fit,
                     {{"letterbox_top_left", Fit::kLetterboxTopLeft},
                      {"letterbox_centre", Fit::kLetterboxCentre},
                      {"resize", Fit::kResize}});
  reader.choice<bool>("colour", input.rgb, {{"bgr", false}, {"rgb", true}});
  reader.number("pad", input.pad, 0, 255);
  reader.number("scale", input.scale, 1e-6, 1e6);
  if (const Json* mean = reader.find("mean")) {
    input.mean = numbersOf(*mean);
    if (input.mean.size() != 3) {
      reader.complain("mean", "is not a list of three numbers");
      input.mean = {0, 0, 0};
    }
  }
  reader.rejectUnknown();
}

void readLevel(const Json& json, const std::string& where, Reader& parent,
               ModelDescription& model) {
  Reader reader(json, where, parent.problems());
  Level level;
  reader.positiveInteger("stride", level.stride);
  if (level.stride > 0 && model.family != Family::kPerdure &&
      (model.input.width % level.stride != 0 || model.input.height % level.stride != 0)) {
    reader.complain("stride", "does not divide the input's width and height");
  }
  if (model.family == Family::kYoloFastest) {
    level.tensor = reader.text("tensor", true);
    const Json* anchors = reader.need("anchors");
    for (std::size_t i = 0; anchors && anchors->is_array() && i < anchors->size(); ++i) {
      const auto pair = numbersOf((*anchors)[i]);
      if (pair.size() == 2 && pair[0] > 0 && pair[1] > 0) {
        level.anchors.emplace_back(pair[0], pair[1]);
      } else {
        reader.complain("anchors", "holds something that is not [width, height]");
      }
    }
    if (anchors && level.anchors.empty()) reader.complain("anchors", "is empty");
  } else if (model.family == Family::kPerdure) {
    level.box = reader.text("box", true);
    level.logits = reader.text("logits", true);
    if (model.azimuth.bins > 0) level.azimuth = reader.text("azimuth", true);
    if (model.spread_scale > 0) level.spread = reader.text("spread", true);
  } else {
    level.box = reader.text("box", true);
    level.objectness = reader.text("objectness", true);
    level.classes = reader.text("classes", true);
  }
  reader.rejectUnknown();
  model.levels.push_back(level);
}

std::vector<std::string> linesOf(const std::filesystem::path& path) {
  std::ifstream in(path);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) {
    while (!line.empty() && std::isspace(static_cast<unsigned char>(line.back()))) line.pop_back();
    if (!line.empty()) lines.push_back(line);
  }
  return lines;
}

void readClasses(Reader& reader, const std::string& file, ModelDescription& model) {
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
    model.classes = linesOf(path);
    if (model.classes.empty()) {
      reader.complain("classes_file", path.string() + " is missing or holds no names");
    }
  }
  std::set<std::string> seen;
  for (std::string& name : model.classes) {
    std::transform(name.begin(), name.end(), name.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (!seen.insert(name).second) reader.complain("classes", "\"" + name + "\" is there twice");
  }
}

void readActivation(const Json& json, Reader& parent, ModelDescription& model) {
  Reader reader(json, "activation.", parent.problems());
  reader.choice<bool>("class", model.class_softmax, {{"sigmoid", false}, {"softmax", true}});
  reader.number("objectness_exponent", model.objectness_exponent, 0.01, 10);
  reader.number("class_exponent", model.class_exponent, 0.01, 10);
  reader.rejectUnknown();
}

void readAzimuth(const Json& json, Reader& parent, ModelDescription& model) {
  Reader reader(json, "azimuth.", parent.problems());
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

/// Soft-max over background and classes is the family's own; nothing is to be chosen.
void readHeads(Reader& reader, ModelDescription& model) {
  if (model.family == Family::kPerdure) {
    if (const Json* azimuth = reader.find("azimuth")) readAzimuth(*azimuth, reader, model);
    reader.number("reach", model.reach, 0, 10);
    reader.number("spread_scale", model.spread_scale, 0, 100);
  } else if (const Json* activation = reader.need("activation")) {
    readActivation(*activation, reader, model);
  }
}

void readInsets(const Json& json, Reader& reader, ModelDescription& model) {
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

void readAll(Reader& reader, const std::string& file, ModelDescription& model) {
  model.name = reader.text("name", false);
  reader.choice<Family>("family", model.family,
                        {{"yolox", Family::kYolox},
                         {"yolo-fastest", Family::kYoloFastest},
                         {"fastestdet", Family::kFastestDet},
                         {"perdure", Family::kPerdure}});
  if (const Json* input = reader.need("input")) readInput(*input, reader, model.input);
  readClasses(reader, file, model);
  readHeads(reader, model);
  if (const Json* levels = reader.need("levels")) {
    for (std::size_t i = 0; levels->is_array() && i < levels->size(); ++i) {
      readLevel((*levels)[i], "levels[" + std::to_string(i) + "].", reader, model);
    }
    if (model.levels.empty()) reader.complain("levels", "is empty");
  }
  reader.number("box_sigma", model.box_sigma, 0, 1);
  if (const Json* insets = reader.find("side_insets")) readInsets(*insets, reader, model);
  if (const Json* calibration = reader.find("calibration")) {
    Reader inner(*calibration, "calibration.", reader.problems());
    inner.number("temperature", model.calibration.temperature, 0.01, 100);
    inner.number("clutter_rate", model.calibration.clutter_rate, 1e-6, 1 - 1e-6);
    inner.rejectUnknown();
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
    Reader reader(json, "", problems);
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
                     message + "\nThe keys are explained in services/inference/README.md.");
}

}  // namespace perdure::inference
