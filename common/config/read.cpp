#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <set>
#include <sstream>

#include "common/base/algorithms/nearest_word.h"
#include "common/config/fields.h"
#include "common/config/text.h"

namespace perdure::config {
namespace {

std::string shortened(const std::string& text) {
  constexpr std::size_t kLongest = 60;
  return text.size() <= kLongest ? text : text.substr(0, kLongest) + "…";
}

template <class Number>
std::optional<Number> parse(const YAML::Node& node) {
  if (!node.IsScalar() || node.Tag() == "!") return std::nullopt;  // "!" marks quoted values
  const std::string& text = node.Scalar();
  const char* begin = text.data() + (text.starts_with('+') ? 1 : 0);
  const char* end = text.data() + text.size();
  Number value = 0;
  const auto [stop, error] = std::from_chars(begin, end, value);
  if (error != std::errc() || stop != end) return std::nullopt;
  return std::isfinite(static_cast<double>(value)) ? std::optional(value) : std::nullopt;
}

bool inside(double value, const Range& range) {
  return (range.low_open ? value > range.low : value >= range.low) && value <= range.high;
}

/// Traverses one document, writes its values into the fields, and collects problems.
class Reader {
 public:
  Reader(Fields& fields, std::string file, bool located)
      : fields_(fields), file_(std::move(file)), located_(located) {}

  void readGroup(const YAML::Node& map, const std::string& prefix) {
    for (const auto& entry : map) {
      if (!entry.first.IsScalar()) {
        problem(entry.first, "a key is not a word");
        continue;
      }
      readEntry(entry.first, entry.second, prefix + entry.first.Scalar());
    }
  }

  void problem(const YAML::Node& node, const std::string& message) {
    problem(node.Mark(), message);
  }

  void problem(const YAML::Mark& mark, const std::string& message) {
    const bool known = located_ && !mark.is_null();
    problems_.push_back({file_, known ? mark.line + 1 : 0, known ? mark.column + 1 : 0, message});
  }

  std::vector<Problem> take() { return std::move(problems_); }

 private:
  void readEntry(const YAML::Node& key, const YAML::Node& value, const std::string& name) {
    if (!seen_.insert(name).second) {
      problem(key, name + ": is given twice; keep one of them");
    } else if (Field* field = find(name)) {
      field->given = true;
      readField(*field, value);
    } else if (const std::string former = fields_.formerlyOf(name); !former.empty()) {
      problem(key, name + ": " + former);
    } else if (!isGroup(name) && !fields_.wasGroup(name)) {
      problem(key, name + ": is not a known key" + suggestion(name));
    } else if (value.IsMap()) {
      seen_.erase(name);  // a group may have several headings, but each key only once
      readGroup(value, name + ".");
    } else if (!value.IsNull()) {
      problem(value, name + ": is a group of keys, not a value; its first key is " +
                         (isGroup(name) ? firstKeyOf(name + ".") : "gone with its group"));
    }
  }

  Field* find(const std::string& name) {
    const auto it = std::find_if(fields_.all().begin(), fields_.all().end(),
                                 [&](const Field& field) { return field.key == name; });
    return it == fields_.all().end() ? nullptr : &*it;
  }

  bool isGroup(const std::string& name) const { return !firstKeyOf(name + ".").empty(); }

  std::string firstKeyOf(const std::string& prefix) const {
    for (const Field& field : fields_.all()) {
      if (field.key.starts_with(prefix)) return field.key;
    }
    return {};
  }

  /// The nearest known key or group, if one is similar enough.
  std::string suggestion(const std::string& name) const {
    std::set<std::string> known;
    for (const Field& field : fields_.all()) {
      known.insert(field.key);
      for (std::size_t dot = field.key.find('.'); dot != std::string::npos;
           dot = field.key.find('.', dot + 1)) {
        known.insert(field.key.substr(0, dot));
      }
    }
    const std::string best = nearestWord(name, {known.begin(), known.end()});
    return best.empty() ? "; --print-config lists the known ones" : "; did you mean " + best + "?";
  }

  void readField(const Field& field, const YAML::Node& value) {
    std::visit([&](auto* target) { read(field, value, *target); }, field.target);
  }

  void refuse(const Field& field, const YAML::Node& node, const std::string& what) {
    std::string value = "a group of keys";
    if (node.IsScalar()) value = node.Tag() == "!" ? quoted(node.Scalar()) : node.Scalar();
    if (node.IsNull()) value = "nothing";
    if (node.IsSequence()) value = "a list";
    const std::string fix = field.doc.fix.empty() ? "" : "; " + field.doc.fix;
    problem(node, field.key + ": " + shortened(value) + " is not " + what + fix);
  }

  std::optional<double> number(const Field& field, const YAML::Node& node) {
    const std::optional<double> value = parse<double>(node);
    if (!value) {
      refuse(field, node, field.doc.unit.empty() ? "a number" : "a number of " + field.doc.unit);
    } else if (!inside(*value, field.range)) {
      refuse(field, node, rangeText(field.range, field.doc.unit));
      return std::nullopt;
    }
    return value;
  }

  void read(const Field& field, const YAML::Node& node, double& target) {
    if (const auto value = number(field, node)) target = *value;
  }

  void read(const Field& field, const YAML::Node& node, std::int64_t& target) {
    const std::optional<std::int64_t> value = parse<std::int64_t>(node);
    if (!value) return refuse(field, node, "a whole number");
    if (!inside(static_cast<double>(*value), field.range)) {
      return refuse(field, node, rangeText(field.range, field.doc.unit));
    }
    target = *value;
  }

  void read(const Field& field, const YAML::Node& node, bool& target) {
    const bool plain = node.IsScalar() && node.Tag() != "!";
    if (!plain || (node.Scalar() != "true" && node.Scalar() != "false")) {
      return refuse(field, node, "true or false");
    }
    target = node.Scalar() == "true";
  }

  void read(const Field& field, const YAML::Node& node, std::string& target) {
    if (!node.IsScalar()) return refuse(field, node, "a text");
    const std::string& value = node.Scalar();
    const auto& choices = field.choices;
    if (!choices.empty() && std::find(choices.begin(), choices.end(), value) == choices.end()) {
      return refuse(field, node, "one of " + choicesText(field));
    }
    target = value;
  }

  void read(const Field& field, const YAML::Node& node, std::vector<double>& target) {
    if (!node.IsSequence()) return refuse(field, node, "a list of numbers");
    std::vector<double> values;
    for (const YAML::Node& element : node) {
      if (const auto value = number(field, element)) values.push_back(*value);
    }
    if (field.length > 0 && node.size() != field.length) {
      problem(node, field.key + ": has " + std::to_string(node.size()) + " values, not " +
                        std::to_string(field.length));
    } else if (values.size() == node.size()) {
      target = std::move(values);
    }
  }

  void read(const Field& field, const YAML::Node& node, std::vector<std::string>& target) {
    if (!node.IsSequence()) return refuse(field, node, "a list of texts");
    std::vector<std::string> values;
    for (const YAML::Node& element : node) {
      if (element.IsScalar()) {
        values.push_back(element.Scalar());
      } else {
        refuse(field, element, "a text");
      }
    }
    if (values.size() == node.size()) target = std::move(values);
  }

  Fields& fields_;
  const std::string file_;
  const bool located_;
  std::set<std::string> seen_;
  std::vector<Problem> problems_;
};

/// Parses a document without storing it.
class Ignore : public YAML::EventHandler {
 public:
  void OnDocumentStart(const YAML::Mark& mark) override { start = mark; }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t,
                const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}

  YAML::Mark start;
};

/// Returns the position of the second document, if any. YAML::LoadAll of 0.7 may loop forever on
/// malformed text, and YAML::Load ignores text after the first document.
std::optional<YAML::Mark> afterFirstDocument(const std::string& yaml) {
  std::istringstream stream(yaml);
  YAML::Parser parser(stream);
  Ignore ignore;
  if (!parser.HandleNextDocument(ignore) || !parser.HandleNextDocument(ignore)) return {};
  return ignore.start;
}

}  // namespace

std::vector<Problem> readYaml(Fields& fields, const std::string& yaml, const std::string& file) {
  Reader reader(fields, file, true);
  try {
    const YAML::Node root = YAML::Load(yaml);
    if (const auto mark = afterFirstDocument(yaml)) {
      reader.problem(*mark, "is not one YAML document: this begins another");
    } else if (root.IsMap()) {
      reader.readGroup(root, "");
    } else if (root.IsDefined() && !root.IsNull()) {
      reader.problem(root, "is not a list of `key: value` lines");
    }
  } catch (const YAML::Exception& error) {
    reader.problem(error.mark, "is not YAML: " + error.msg);
  }
  return reader.take();
}

std::vector<Problem> readFile(Fields& fields, const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream.is_open() || std::filesystem::is_directory(path)) {
    return {{path, 0, 0, "cannot be read; check the path and its permissions"}};
  }
  return readYaml(fields, std::string(std::istreambuf_iterator<char>(stream), {}), path);
}

std::vector<Problem> assign(Fields& fields, const std::string& assignment) {
  const std::string file = "--set " + shortened(assignment);
  const std::size_t equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0) {
    return {{file, 0, 0, "is not key=value"}};
  }
  Reader reader(fields, file, false);
  try {
    const std::string key = assignment.substr(0, equals), value = assignment.substr(equals + 1);
    const bool text = std::any_of(fields.all().begin(), fields.all().end(), [&](const Field& one) {
      return one.key == key && one.choices.empty() &&
             std::holds_alternative<std::string*>(one.target);
    });
    const bool quoted = value.starts_with('"') || value.starts_with('\'');
    YAML::Node map;
    map[key] = text && !quoted ? YAML::Node(value) : YAML::Load(value);
    reader.readGroup(map, "");
  } catch (const YAML::Exception& error) {
    reader.problem(error.mark, "the value is not YAML: " + error.msg);
  }
  return reader.take();
}

std::vector<Problem> missing(const Fields& fields, const std::string& file) {
  std::vector<Problem> problems;
  for (const Field& field : fields.all()) {
    if (!field.required || field.given) continue;
    const std::string fix = field.doc.fix.empty() ? field.doc.text : field.doc.fix;
    problems.push_back({file, 0, 0, field.key + ": is missing; " + fix});
  }
  return problems;
}

}  // namespace perdure::config
