// The arguments of the tools: their JSON schemas, and the conditions on objects that they describe.
#pragma once

#include <Eigen/Core>
#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

#include "common/types/map.h"
#include "services/gateway/mcp/tools.h"

namespace perdure::gateway::mcp {

/// Returns the schema of an object with these arguments, which must be known.
Json schemaOfArguments(std::initializer_list<const char*> names,
                       std::initializer_list<const char*> required);

/// Checks the arguments against their schema. Throws NoAnswer with the fix.
void checkArguments(const Json& arguments, const Json& schema);

/// Conditions on objects. A condition that is not set is met by all objects.
struct Conditions {
  std::string class_name;
  std::vector<std::string> words;       ///< of a text, in lower case and in the singular
  std::optional<Eigen::Vector2d> near;  ///< in M, m
  double radius_m = 0.0;                ///< around `near`
  TimePoint since = TimePoint::min(), until = TimePoint::max();  ///< seen at some time in between
  TimePoint changed_since = TimePoint::min();
  double least_probability = 0.0;
  std::size_t limit = 10;

  /// `arguments` were checked. Throws NoAnswer if they contradict each other.
  explicit Conditions(const Json& arguments);

  bool namesClass() const { return !class_name.empty() || !words.empty(); }
  bool matchesClass(const std::string& name) const;
  /// Whether a horizontal position is within the radius.
  bool includes(const Eigen::Vector2d& p) const { return !near || (p - *near).norm() <= radius_m; }
  /// Whether a belief may meet the conditions; one without classes meets only those without class
  /// and place.
  bool admits(const ObjectBelief& object) const;
  /// The probability that an object exists, has the class and lies within the radius.
  double probabilityOf(const ObjectBelief& object) const;
};

}  // namespace perdure::gateway::mcp
