// Reads one JSON object key by key, and collects all errors, including unknown keys.
#pragma once

#include <cmath>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace perdure::inference {

using Json = nlohmann::json;

/// `where` is the prefix of the keys in messages. The reader adds errors to `problems`, which must
/// outlive it.
class JsonReader {
 public:
  JsonReader(const Json& json, std::string where, std::vector<std::string>& problems)
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
    if (need(key)) integer(key, target, 1, 8192);
  }

  /// Reads an integer in [low, high]. `target` does not change if the key is absent.
  void integer(const std::string& key, int& target, int low, int high) {
    const Json* value = find(key);
    if (!value) return;
    if (!value->is_number_integer() || value->get<std::int64_t>() < low ||
        value->get<std::int64_t>() > high) {
      return complain(
          key, "is not an integer from " + std::to_string(low) + " to " + std::to_string(high));
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
  void choice(const std::string& key, T& target, const std::map<std::string, T>& values,
              bool required = true) {
    const std::string name = text(key, required);
    const auto it = values.find(name);
    if (it != values.end()) {
      target = it->second;
    } else if (!name.empty()) {
      std::string known;
      for (const auto& [word, value] : values) known += (known.empty() ? "" : ", ") + word;
      complain(key, "\"" + name + "\" is not one of " + known);
    }
  }

  void flag(const std::string& key, bool& target) {
    const Json* value = find(key);
    if (!value) return;
    if (!value->is_boolean()) return complain(key, "is not true or false");
    target = value->get<bool>();
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

/// Returns the numbers of a list; none if the value is not a list of numbers.
inline std::vector<double> numbersOf(const Json& json) {
  std::vector<double> numbers;
  if (!json.is_array()) return {};
  for (const Json& value : json) {
    if (!value.is_number()) return {};
    numbers.push_back(value.get<double>());
  }
  return numbers;
}

}  // namespace perdure::inference
