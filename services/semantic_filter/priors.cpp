#include "services/semantic_filter/priors.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <optional>
#include <sstream>

#include "common/base/errors.h"
#include "common/types/objects.h"

namespace perdure::semantic_filter {
namespace {

/// Returns the numbers of a list, or nothing if it is not a list of numbers.
std::optional<std::vector<double>> numbersOf(const YAML::Node& list) {
  if (!list.IsSequence()) return std::nullopt;
  std::vector<double> numbers;
  for (const YAML::Node& item : list) {
    if (!YAML::convert<double>::decode(item, numbers.emplace_back())) return std::nullopt;
  }
  return numbers;
}

class PriorsReader {
 public:
  explicit PriorsReader(std::string file) : file_(std::move(file)) {}

  void complain(const YAML::Node& node, const std::string& message) {
    const auto mark = node.Mark();
    problems_ += fmt::format("{}:{}:{}: {}\n", file_, mark.line + 1, mark.column + 1, message);
  }

  double number(const YAML::Node& parent, const std::string& key, double standard, double low,
                double high) {
    const YAML::Node node = parent[key];
    if (!node) return standard;
    double value = 0.0;
    if (!YAML::convert<double>::decode(node, value) || !(value >= low && value <= high)) {
      complain(node, fmt::format("{}: is not a number from {:g} to {:g}", key, low, high));
      return standard;
    }
    return value;
  }

  void threeNumbers(const YAML::Node& parent, const std::string& key, double low, double high,
                    Eigen::Vector3d& target) {
    const YAML::Node node = parent[key];
    if (!node) return;
    if (!node.IsSequence() || node.size() != 3) {
      return complain(node, key + ": write three numbers, for length, width and height");
    }
    for (std::size_t i = 0; i < 3; ++i) {
      double value = 0.0;
      if (!YAML::convert<double>::decode(node[i], value) || !(value >= low && value <= high)) {
        return complain(node[i],
                        fmt::format("{}: each is a number from {:g} to {:g}", key, low, high));
      }
      target[static_cast<Eigen::Index>(i)] = value;
    }
  }

  /// Returns the name of a class or key; empty if it is not a name.
  std::string name(const YAML::Node& node) {
    if (node.IsScalar() && !node.Scalar().empty()) return node.Scalar();
    complain(node, "names of classes and keys are texts; write NAME: VALUE");
    return {};
  }

  ClassPrior prior(const YAML::Node& node, const ClassPrior& standard) {
    ClassPrior p = standard;
    if (!node.IsMap()) {
      complain(node, "a class is a mapping: {size: [l, w, h], …}");
      return p;
    }
    checkKeys(node);
    Eigen::Vector3d size = standard.log_size.array().exp();
    Eigen::Vector3d spread = standard.log_size_covariance.diagonal().array().sqrt();
    threeNumbers(node, "size", 0.005, 500.0, size);
    threeNumbers(node, "spread", 0.01, 3.0, spread);
    const double old_common = standard.log_size_covariance(0, 1);
    const double common = number(node, "common", std::sqrt(std::max(old_common, 0.0)), 0.0, 3.0);
    p.log_size = size.array().log();
    p.log_size_covariance = Eigen::Vector3d(spread.array().square()).asDiagonal();
    p.log_size_covariance.array() += common * common;
    if (!node["spread"] && !node["common"]) p.log_size_covariance = standard.log_size_covariance;
    p.frequency = number(node, "frequency", standard.frequency, 1e-6, 1e6);
    p.detection_probability = number(node, "detection", standard.detection_probability, 0.01, 0.99);
    p.moving = number(node, "moving", standard.moving, 0.0, 0.99);
    p.speed_sigma = number(node, "speed", standard.speed_sigma, 0.0, 100.0);
    p.azimuth_sigma = number(node, "azimuth_sigma", standard.azimuth_sigma, 0.01, 3.2);
    p.stands = number(node, "stands", standard.stands, 0.0, 0.999);
    const YAML::Node yaw = node["yaw"];
    if (yaw && !YAML::convert<bool>::decode(yaw, p.has_yaw)) complain(yaw, "yaw: is true or false");
    shape(node, p.shape);
    return p;
  }

  void throwIfAny() const {
    if (!problems_.empty()) throw StartupError(ExitCode::kConfiguration, problems_);
  }

 private:
  void shape(const YAML::Node& parent, Shape& target) {
    const YAML::Node node = parent["shape"];
    if (!node) return;
    const auto wrong = [&](const YAML::Node& at) {
      complain(at,
               "shape: one to three levels from the ground up, each [height, along, across, "
               "corner] or [height, along, across, corner, forward]: -1 to 1, three shares from "
               "0.05 to 1, and at most 1 - along");
    };
    if (!node.IsSequence() || node.size() == 0 || node.size() > Shape::kMostLevels) {
      return wrong(node);
    }
    std::vector<ShapeLevel> levels;
    for (const YAML::Node& item : node) {
      const auto numbers = numbersOf(item);
      if (!numbers || numbers->size() < 4 || numbers->size() > 5) return wrong(item);
      const std::vector<double>& v = *numbers;
      const bool shares =
          std::all_of(v.begin() + 1, v.begin() + 4, [](double s) { return s >= 0.05 && s <= 1.0; });
      const double forward = v.size() == 5 ? v[4] : 0.0;
      const bool within = std::abs(forward) + v[1] <= 1.0;
      if (!shares || !within || !(v[0] >= -1.0 && v[0] <= 1.0)) return wrong(item);
      levels.push_back({v[0], v[1], v[2], v[3], forward});
    }
    target = shapeOf(levels);
  }

  void checkKeys(const YAML::Node& node) {
    static const std::vector<std::string> known = {"size",      "spread", "common", "frequency",
                                                   "detection", "moving", "speed",  "azimuth_sigma",
                                                   "yaw",       "shape",  "stands"};
    for (const auto& item : node) {
      const std::string key = name(item.first);
      if (!key.empty() && std::find(known.begin(), known.end(), key) == known.end()) {
        complain(item.first, fmt::format("{}: unknown; keys are {}", key, fmt::join(known, ", ")));
      }
    }
  }

  std::string file_, problems_;
};

bool isLowerCase(const std::string& name) {
  return std::none_of(name.begin(), name.end(),
                      [](unsigned char c) { return std::isupper(c) != 0; });
}

}  // namespace

ClassPriors parseClassPriors(const std::string& yaml, const std::string& file) {
  YAML::Node root;
  try {
    root = YAML::Load(yaml);
  } catch (const YAML::ParserException& e) {
    throw StartupError(ExitCode::kConfiguration, fmt::format("{}:{}:{}: {}", file, e.mark.line + 1,
                                                             e.mark.column + 1, e.msg));
  }
  PriorsReader reader(file);
  ClassPriors priors;
  if (!root.IsMap() || !root["fallback"] || !root["other"] || !root["classes"] ||
      !root["classes"].IsMap()) {
    throw StartupError(ExitCode::kConfiguration,
                       file + ": holds the mappings fallback, other and classes");
  }
  priors.fallback = reader.prior(root["fallback"], ClassPrior{});
  priors.other = reader.prior(root["other"], priors.fallback);
  priors.other.name = kOtherClass;
  for (const auto& item : root["classes"]) {
    ClassPrior p = reader.prior(item.second, priors.fallback);
    p.name = reader.name(item.first);
    if (!isLowerCase(p.name)) reader.complain(item.first, p.name + ": names are lower-case");
    priors.classes.push_back(p);
  }
  reader.throwIfAny();
  return priors;
}

ClassPriors loadPriors(const Config& config) { return loadClassPriors(config.class_priors); }

std::map<std::string, std::vector<Eigen::Vector3d>> shapePoints(const ClassPriors& priors) {
  std::map<std::string, std::vector<Eigen::Vector3d>> result;
  for (const auto& prior : priors.classes) {
    for (int i = 0; i < prior.shape.corners(); ++i) {
      result[prior.name].push_back(prior.shape.corner(i, 0.0));
    }
  }
  return result;
}

ClassPriors loadClassPriors(const std::string& path) {
  std::ifstream in(path);
  if (!in) {
    throw StartupError(ExitCode::kUnavailable,
                       path +
                           ": cannot be read; set class_priors to the file of class priors "
                           "(config/class_priors.yaml in the sources).");
  }
  std::stringstream text;
  text << in.rdbuf();
  return parseClassPriors(text.str(), path);
}

}  // namespace perdure::semantic_filter
