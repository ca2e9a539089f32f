// Collects problems with the inputs: counts by input and reason, and a sentence with the fix.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "common/base/result.h"

namespace perdure::ros2 {

class Troubles {
 public:
  void add(const std::string& input, const Reason& reason, std::int64_t now_ns) {
    const std::string code = input + "_" + reason.code;
    counts_.add(code);
    first_.emplace(code, reason.detail);
    if (!reason.detail.empty()) last_ = reason.detail, last_ns_ = now_ns, any_ = true;
  }
  const ReasonCounts& counts() const { return counts_; }
  const std::map<std::string, std::string>& sentences() const { return first_; }
  /// Returns the newest sentence if it is at most `longest_ns` old; otherwise empty.
  std::string newest(std::int64_t now_ns, std::int64_t longest_ns) const {
    return any_ && now_ns - last_ns_ <= longest_ns ? last_ : std::string();
  }

 private:
  ReasonCounts counts_;
  std::map<std::string, std::string> first_;
  std::string last_;
  std::int64_t last_ns_ = 0;
  bool any_ = false;
};

}  // namespace perdure::ros2
