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
  /// `worth` decides whether a line, without its line end, is passed on. Only one object may exist
  /// in a process.
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
