// One description of a configuration's fields, for reading, validation, printing and the tables of
// the README files. A service writes `void describe(Config&, config::Fields&)`.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <variant>
#include <vector>

namespace perdure::config {

/// Documentation of a field for users. `fix` ends the error message: "…; <fix>".
struct Doc {
  std::string text;       ///< text in one line
  std::string unit = {};  ///< such as "rad/s/√Hz"; "" for no unit
  std::string fix = {};
};

struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_open = false;  ///< the lower bound itself is excluded
};
inline Range positive() { return {0.0, std::numeric_limits<double>::infinity(), true}; }
inline Range atLeast(double low) { return {low, std::numeric_limits<double>::infinity(), false}; }
inline Range between(double low, double high) { return {low, high, false}; }

/// A field bound to a variable, which has its default value until a file or --set changes it.
struct Field {
  using Target = std::variant<double*, std::int64_t*, bool*, std::string*, std::vector<double>*,
                              std::vector<std::string>*>;
  std::string key;  ///< dotted key, such as "tracker.max_points"
  Target target;
  Range range;                       ///< range of a number, or of each number in a list
  std::vector<std::string> choices;  ///< allowed values of strings; empty: any
  std::size_t length = 0;            ///< required length of lists; 0: any
  bool required = false;             ///< the file or --set must give a value
  bool expert = false;               ///< intended for experts
  Doc doc;
  bool given =
      false;  ///< set by readYaml and assign if the key is given, even if the value was refused
};

class Fields {
 public:
  void number(std::string key, double& target, Range range, Doc doc);
  void integer(std::string key, std::int64_t& target, Range range, Doc doc);
  void boolean(std::string key, bool& target, Doc doc);
  void text(std::string key, std::string& target, Doc doc);
  void choice(std::string key, std::string& target, std::vector<std::string> choices, Doc doc);
  void numbers(std::string key, std::vector<double>& target, Range range, Doc doc,
               std::size_t length = 0);
  void texts(std::string key, std::vector<std::string>& target, Doc doc);
  void require();
  void expert(bool on) { expert_ = on; }
  /// Declares a key of earlier versions. Reading refuses it with `sentence`: "is now
  /// tracks.confirm".
  void formerly(std::string key, std::string sentence);

  /// Returns the sentence given to formerly() for this key, otherwise "".
  std::string formerlyOf(const std::string& key) const;
  /// Returns whether earlier versions had keys in this group.
  bool wasGroup(const std::string& name) const;

  const std::vector<Field>& all() const { return fields_; }
  std::vector<Field>& all() { return fields_; }

 private:
  Field& add(std::string key, Field::Target target, Doc doc);
  std::vector<Field> fields_;
  std::map<std::string, std::string> formerly_;
  bool expert_ = false;
};

/// One error. str() returns "file:line:col: key: value is not > 0 rad/s/√Hz; fix".
struct Problem {
  std::string file;
  int line = 0, column = 0;  ///< counted from 1; 0 without a position (--set, missing key)
  std::string message;
  std::string str() const;
};

/// Reads YAML text into the fields' targets and returns *all* problems at once. Problems are syntax
/// errors, unknown keys (with the nearest known one), wrong types, values out of range, missing
/// keys and repeated keys. Targets of faulty fields retain their defaults.
std::vector<Problem> readYaml(Fields& fields, const std::string& yaml, const std::string& file);
/// Applies readYaml to the content of a file. A file that cannot be read is a problem too.
std::vector<Problem> readFile(Fields& fields, const std::string& path);
/// Applies "key=value" from --set. The value is YAML, but text needs no quotes.
std::vector<Problem> assign(Fields& fields, const std::string& assignment);
/// Returns the problems of required fields that neither a file nor --set has given. readYaml and
/// assign record which fields were given.
std::vector<Problem> missing(const Fields& fields, const std::string& file);

/// Throws StartupError (78) with one line per problem. Does nothing if there are none.
void refuse(const std::vector<Problem>& problems);

/// The current values as commented YAML, which reads back to the same values.
std::string toYaml(const Fields& fields);
/// A Markdown table: key, default, unit, range, meaning.
std::string toMarkdown(const Fields& fields);

}  // namespace perdure::config
