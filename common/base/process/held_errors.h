// What is written to std::cerr while this lives, line by line, and only what is worth it: for
// libraries that complain of what does not matter.
#pragma once

#include <functional>
#include <sstream>
#include <streambuf>
#include <string>

namespace perdure {

class HeldErrors {
 public:
  /// `worth`: whether a line, without its end, is passed on. One at a time in a process.
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
