#include "common/config/fields.h"

#include "common/base/check.h"
#include "common/base/errors.h"

namespace perdure::config {

Field& Fields::add(std::string key, Field::Target target, Doc doc) {
  for (const Field& field : fields_) check(field.key != key, "each key is described once");
  Field& field = fields_.emplace_back();
  field.key = std::move(key);
  field.target = target;
  field.doc = std::move(doc);
  field.expert = expert_;
  return field;
}

void Fields::number(std::string key, double& target, Range range, Doc doc) {
  add(std::move(key), &target, std::move(doc)).range = range;
}

void Fields::integer(std::string key, std::int64_t& target, Range range, Doc doc) {
  add(std::move(key), &target, std::move(doc)).range = range;
}

void Fields::boolean(std::string key, bool& target, Doc doc) {
  add(std::move(key), &target, std::move(doc));
}

void Fields::text(std::string key, std::string& target, Doc doc) {
  add(std::move(key), &target, std::move(doc));
}

void Fields::choice(std::string key, std::string& target, std::vector<std::string> choices,
                    Doc doc) {
  add(std::move(key), &target, std::move(doc)).choices = std::move(choices);
}

void Fields::numbers(std::string key, std::vector<double>& target, Range range, Doc doc,
                     std::size_t length) {
  Field& field = add(std::move(key), &target, std::move(doc));
  field.range = range;
  field.length = length;
}

void Fields::texts(std::string key, std::vector<std::string>& target, Doc doc) {
  add(std::move(key), &target, std::move(doc));
}

void Fields::formerly(std::string key, std::string sentence) {
  formerly_.emplace(std::move(key), std::move(sentence));
}

std::string Fields::formerlyOf(const std::string& key) const {
  const auto it = formerly_.find(key);
  return it == formerly_.end() ? "" : it->second;
}

bool Fields::wasGroup(const std::string& name) const {
  const std::string prefix = name + ".";
  const auto it = formerly_.lower_bound(prefix);
  return it != formerly_.end() && it->first.starts_with(prefix);
}

void Fields::require() {
  check(!fields_.empty(), "require() follows the description of a field");
  fields_.back().required = true;
}

std::string Problem::str() const {
  std::string place = file;
  if (line > 0) place += ":" + std::to_string(line) + ":" + std::to_string(column);
  return place.empty() ? message : place + ": " + message;
}

void refuse(const std::vector<Problem>& problems) {
  if (problems.empty()) return;
  std::string text;
  for (const Problem& problem : problems) text += (text.empty() ? "" : "\n") + problem.str();
  throw StartupError(ExitCode::kConfiguration, text);
}

}  // namespace perdure::config
