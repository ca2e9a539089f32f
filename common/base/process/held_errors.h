// Filters the lines that are written to std::cerr during the lifetime of an object, for libraries
// that print irrelevant warnings.
#pragma once

#include <functional>
#include <sstream>
#include <streambuf>
#include <string>

namespace perdure {

class HeldErrors {
 public:
  /// `worth` decides whether a line, passed without its line end, is printed when this object ends.
  /// Only one object may exist in a process at a time.
  explicit HeldErrors(std::function<bool(const std::string&)> worth);
  ~HeldErrors();
  HeldErrors(const HeldErrors&) = delete;
  HeldErrors& operator=(const HeldErrors&) = delete;

 private:
  const std::function<bool(const std::string&)> worth_;
  std::stringstream said_;
  std::streambuf* const before_;
};

}  // namespace perdure
