// Filters the lines that are written to std::cerr during the lifetime of an object, for libraries
// that print irrelevant warnings.
#pragma once

#include <functional>
#include <streambuf>
#include <string>

namespace perdure {

class HeldErrors : private std::streambuf {
 public:
  /// `worth` decides whether a line, passed without its line end, is printed. A line is printed at
  /// its end, so that an abort of the process loses no complete line. Only one object may exist in
  /// a process at a time.
  explicit HeldErrors(std::function<bool(const std::string&)> worth);
  ~HeldErrors() override;
  HeldErrors(const HeldErrors&) = delete;
  HeldErrors& operator=(const HeldErrors&) = delete;

 private:
  int_type overflow(int_type character) override;
  void endLine();

  const std::function<bool(const std::string&)> worth_;
  std::string line_;
  std::streambuf* const before_;
};

}  // namespace perdure
