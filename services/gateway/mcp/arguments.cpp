#include "services/gateway/mcp/arguments.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

namespace perdure::gateway::mcp {
namespace {

const Json& knownArguments() {
  static const Json known = Json::parse(R"({
    "class": {"type": "string", "description": "name of a class, for example car"},
    "text": {"type": "string", "description": "words; objects of the classes that they name"},
    "near": {"type": "array",
      "items": {"type": "number", "minimum": -1e7, "maximum": 1e7}, "minItems": 2, "maxItems": 3,
      "description": "place [x, y] or [x, y, z] in M, m; z is ignored"},
    "radius_m": {"type": "number", "exclusiveMinimum": 0, "maximum": 10000,
      "description": "horizontal distance from near, m"},
    "seen_since_s": {"type": "number", "minimum": -4e9, "maximum": 4e9, "description": "seen at this time or later"},
    "seen_until_s": {"type": "number", "minimum": -4e9, "maximum": 4e9, "description": "seen at this time or earlier"},
    "since_s": {"type": "number", "minimum": -4e9, "maximum": 4e9, "description": "changes at this time or later"},
    "min_probability": {"type": "number", "minimum": 0, "maximum": 1,
      "description": "least match_probability"},
    "limit": {"type": "integer", "minimum": 1, "maximum": 50,
      "description": "at most so many results; 10 if not given"},
    "id": {"type": "integer", "minimum": 1, "description": "id of an object"},
    "object": {"type": "integer", "minimum": 1, "description": "id of an object"},
    "kind": {"type": "string", "enum": ["not_there", "class", "same", "different"],
      "description": "what is stated about the object"},
    "other": {"type": "integer", "minimum": 1, "description": "the object that is the same or different"},
    "nats": {"type": "number", "minimum": 0.01, "maximum": 50,
      "description": "log-likelihood ratio of the statement; the map's default if not given"},
    "author": {"type": "string", "maxLength": 256, "description": "the person who states it"},
    "withdraw": {"type": "integer", "minimum": 1, "description": "number of a correction"}})");
  return known;
}

/// Whether a value meets its schema. Only the keywords of knownArguments() are known.
bool isValid(const Json& value, const Json& schema) {
  if (schema["type"] == "string") {
    const Json choices = schema.value("enum", Json::array({value}));
    return value.is_string() && std::ranges::find(choices, value) != choices.end() &&
           value.get_ref<const std::string&>().size() <= schema.value("maxLength", SIZE_MAX);
  }
  if (schema["type"] == "array") {
    return value.is_array() && value.size() >= schema["minItems"] &&
           value.size() <= schema["maxItems"] && std::ranges::all_of(value, [&](const Json& each) {
             return isValid(each, schema["items"]);
           });
  }
  const bool has_type = schema["type"] == "integer" ? value.is_number_integer() : value.is_number();
  constexpr double kLargest = 1e300;
  return has_type && value >= schema.value("minimum", -kLargest) &&
         value <= schema.value("maximum", kLargest) &&
         value > schema.value("exclusiveMinimum", -kLargest);
}

/// Returns the words in lower case. A final "s" is removed, because classes are in the singular.
std::vector<std::string> wordsOf(const std::string& text) {
  std::string plain;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    plain += std::isalnum(byte) != 0 || byte >= 0x80 ? static_cast<char>(std::tolower(byte)) : ' ';
  }
  std::istringstream stream(plain);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) {
    if (word.size() > 3 && word.ends_with('s') && !word.ends_with("ss")) word.pop_back();
    words.push_back(word);
  }
  return words;
}

TimePoint timeIn(const Json& arguments, const char* name, TimePoint otherwise) {
  const auto at = arguments.find(name);
  return at == arguments.end() ? otherwise : TimePoint(durationFromSeconds(at->get<double>()));
}

/// The probability that the centre lies within the radius, by the covariance along the line to it.
double probabilityWithin(const ClassBelief& belief, const Eigen::Vector2d& near, double radius_m) {
  const Eigen::Vector2d offset = belief.mean.head<2>() - near;
  const double distance = offset.norm();
  const Eigen::Vector2d along = distance > 0.0 ? (offset / distance).eval() : Eigen::Vector2d(1, 0);
  const double variance = along.dot(belief.covariance.topLeftCorner<2, 2>() * along);
  return 0.5 * std::erfc((distance - radius_m) / std::sqrt(2.0 * std::max(variance, 1e-12)));
}

}  // namespace

Json schemaOfArguments(std::initializer_list<const char*> names,
                       std::initializer_list<const char*> required) {
  Json properties = Json::object();
  for (const char* name : names) properties[name] = knownArguments().at(name);
  return {{"type", "object"},
          {"properties", properties},
          {"required", std::vector<std::string>(required.begin(), required.end())},
          {"additionalProperties", false}};
}

void checkArguments(const Json& arguments, const Json& schema) {
  const Json& properties = schema["properties"];
  for (const auto& [name, value] : arguments.items()) {
    if (!properties.contains(name)) {
      std::string names;
      for (const auto& [known, of] : properties.items())
        names += (names.empty() ? "" : ", ") + known;
      throw NoAnswer("there is no argument " + name + "; this tool takes: " + names);
    }
    const Json& wanted = properties[name];
    if (!isValid(value, wanted)) {
      throw NoAnswer("the value of " + name + " is not valid; its schema is " + wanted.dump());
    }
  }
  for (const Json& name : schema["required"]) {
    if (!arguments.contains(name)) throw NoAnswer("give the argument " + name.get<std::string>());
  }
}

Conditions::Conditions(const Json& arguments)
    : class_name(arguments.value("class", "")),
      words(wordsOf(arguments.value("text", ""))),
      radius_m(arguments.value("radius_m", 0.0)),
      since(timeIn(arguments, "seen_since_s", TimePoint::min())),
      until(timeIn(arguments, "seen_until_s", TimePoint::max())),
      changed_since(timeIn(arguments, "since_s", TimePoint::min())),
      least_probability(arguments.value("min_probability", 0.0)),
      limit(arguments.value("limit", std::size_t{10})) {
  std::ranges::transform(class_name, class_name.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (arguments.contains("near") != arguments.contains("radius_m")) {
    throw NoAnswer("give near and radius_m together");
  }
  if (arguments.contains("text") && words.empty()) throw NoAnswer("text has no word");
  if (arguments.contains("near")) {
    near = Eigen::Vector2d(arguments["near"][0].get<double>(), arguments["near"][1].get<double>());
  }
}

bool Conditions::matchesClass(const std::string& name) const {
  if (!class_name.empty() && name != class_name) return false;
  if (words.empty()) return true;
  return std::ranges::all_of(wordsOf(name), [&](const std::string& word) {
    return std::ranges::find(words, word) != words.end();
  });
}

bool Conditions::admits(const ObjectBelief& object) const {
  if (object.classes.empty()) return !near && !namesClass();
  return includes(object.best().mean.head<2>()) && matchesClass(object.best().name);
}

double Conditions::probabilityOf(const ObjectBelief& object) const {
  double probability = 0.0;
  for (const ClassBelief& belief : object.classes) {
    if (!matchesClass(belief.name)) continue;
    probability += belief.probability * (near ? probabilityWithin(belief, *near, radius_m) : 1.0);
  }
  return object.existence * std::min(probability, 1.0);
}

}  // namespace perdure::gateway::mcp
