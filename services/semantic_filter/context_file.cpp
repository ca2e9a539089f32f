#include "services/semantic_filter/context_file.h"

#include <yaml-cpp/yaml.h>

#include <cctype>
#include <cmath>
#include <fstream>
#include <iomanip>
#include <set>
#include <sstream>

#include "common/base/errors.h"
#include "common/types/objects.h"

namespace perdure::semantic_filter {
namespace {

constexpr double kFarthest = 100.0;  // m
constexpr double kMostNats = 20.0;
constexpr double kSymmetry = 1e-6;

class Reader {
 public:
  explicit Reader(std::string file) : file_(std::move(file)) {}

  void complain(const YAML::Node& node, const std::string& message) {
    const auto mark = node.Mark();
    problems_ += file_ + ":" + std::to_string(mark.line + 1) + ":" +
                 std::to_string(mark.column + 1) + ": " + message + "\n";
  }

  void radius(const YAML::Node& node, ContextMatrix& matrix) {
    if (!YAML::convert<double>::decode(node, matrix.radius_m) ||
        !(matrix.radius_m > 0.0 && matrix.radius_m <= kFarthest)) {
      complain(node, "radius: is not a number of metres above 0, at most 100");
    }
  }

  void classes(const YAML::Node& node, ContextMatrix& matrix) {
    if (!node.IsSequence() || node.size() == 0) {
      return complain(node, "classes: is a list of at least one name");
    }
    for (const auto& item : node) {
      const std::string name = item.IsScalar() ? item.Scalar() : "";
      const bool upper = std::any_of(name.begin(), name.end(),
                                     [](unsigned char c) { return std::isupper(c) != 0; });
      if (name.empty() || upper) complain(item, "classes: names are lower-case text");
      if (!names_.insert(name).second) complain(item, "classes: " + name + " is there twice");
      if (name == kOtherClass) complain(item, "classes: \"other\" has no context; leave it out");
      matrix.classes.push_back(name);
    }
  }

  void ratios(const YAML::Node& node, ContextMatrix& matrix) {
    const auto n = static_cast<Eigen::Index>(matrix.classes.size());
    matrix.log_ratio.setZero(n, n);
    const std::string shape =
        "log_ratio: write " + std::to_string(n) + " rows of " + std::to_string(n) + " numbers";
    if (!node.IsSequence() || static_cast<Eigen::Index>(node.size()) != n) {
      return complain(node, shape);
    }
    for (Eigen::Index i = 0; i < n; ++i) {
      const YAML::Node row = node[static_cast<std::size_t>(i)];
      if (!row.IsSequence() || static_cast<Eigen::Index>(row.size()) != n) {
        return complain(row, shape);
      }
      for (Eigen::Index j = 0; j < n; ++j) ratio(row[static_cast<std::size_t>(j)], i, j, matrix);
    }
  }

  void throwIfAny() const {
    if (!problems_.empty()) throw StartupError(ExitCode::kConfiguration, problems_);
  }

 private:
  void ratio(const YAML::Node& node, Eigen::Index i, Eigen::Index j, ContextMatrix& matrix) {
    double& value = matrix.log_ratio(i, j);
    if (!YAML::convert<double>::decode(node, value) || !(std::abs(value) <= kMostNats)) {
      value = 0.0;
      return complain(node, "log_ratio: is not a number from -20 to 20 nats");
    }
    if (j < i && std::abs(value - matrix.log_ratio(j, i)) > kSymmetry) {
      complain(node, "log_ratio: differs from that of the two classes the other way round");
    }
  }

  std::string file_, problems_;
  std::set<std::string> names_;
};

}  // namespace

ContextMatrix parseContext(const std::string& yaml, const std::string& file) {
  YAML::Node root;
  try {
    root = YAML::Load(yaml);
  } catch (const YAML::ParserException& e) {
    throw StartupError(ExitCode::kConfiguration, file + ":" + std::to_string(e.mark.line + 1) +
                                                     ":" + std::to_string(e.mark.column + 1) +
                                                     ": " + e.msg);
  }
  if (!root.IsMap() || !root["radius"] || !root["classes"] || !root["log_ratio"]) {
    throw StartupError(ExitCode::kConfiguration,
                       file +
                           ": holds radius, classes and log_ratio; make one with "
                           "`perdure map learn-context`");
  }
  Reader reader(file);
  ContextMatrix matrix;
  reader.radius(root["radius"], matrix);
  reader.classes(root["classes"], matrix);
  reader.ratios(root["log_ratio"], matrix);
  reader.throwIfAny();
  return matrix;
}

ContextMatrix loadContext(const std::string& path) {
  std::ifstream in(path);
  if (!in) {
    throw StartupError(ExitCode::kUnavailable,
                       path +
                           ": cannot be read; set context to a file that `perdure map "
                           "learn-context` wrote, or to \"\" to do without.");
  }
  std::stringstream text;
  text << in.rdbuf();
  return parseContext(text.str(), path);
}

std::string formatContext(const ContextMatrix& matrix, const std::string& note) {
  std::ostringstream text;
  text << "# " << note << "\n# log P(a near b) / (P(a) P(b)), nats; rows and columns as classes.\n"
       << "radius: " << matrix.radius_m << "\nclasses: [";
  for (std::size_t i = 0; i < matrix.classes.size(); ++i) {
    text << (i > 0 ? ", " : "") << YAML::Dump(YAML::Node(matrix.classes[i]));
  }
  text << "]\nlog_ratio:\n" << std::fixed << std::setprecision(3);
  for (Eigen::Index i = 0; i < matrix.log_ratio.rows(); ++i) {
    text << "  - [";
    for (Eigen::Index j = 0; j < matrix.log_ratio.cols(); ++j) {
      text << (j > 0 ? ", " : "") << matrix.log_ratio(i, j);
    }
    text << "]\n";
  }
  return text.str();
}

}  // namespace perdure::semantic_filter
