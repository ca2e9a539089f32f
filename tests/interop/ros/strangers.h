// Programs that are not ours, as tests call them: npm's libraries for MCAP and ROS 2, Debian's
// rosbag.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/process/support.h"

namespace perdure::test {

/// The scripts of this folder over npm's libraries, which are installed when it is first asked for.
class Npm {
 public:
  static const Npm& one();
  /// Why there are none; empty where they are.
  const std::string& whyNot() const { return why_not_; }
  /// A script and its arguments; what it printed. It must end well.
  std::string run(std::vector<std::string> command) const;

 private:
  Npm();
  Folder place_;
  std::string why_not_;
};

/// Empty where there is one.
std::string whyNoRosbag();
/// compression: none, bz2, lz4.
void writeBag(const std::filesystem::path& plan, const std::filesystem::path& bag,
              const std::string& compression);

}  // namespace perdure::test
