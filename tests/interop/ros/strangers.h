// Foreign programs that tests call: npm's libraries for MCAP and ROS 2, Debian's rosbag.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/process/support.h"

namespace perdure::test {

/// Runs the scripts of this folder with npm's libraries, which are installed at the first use.
class Npm {
 public:
  static const Npm& one();
  /// Returns why npm's libraries are missing; empty if they are installed.
  const std::string& whyNot() const { return why_not_; }
  /// Runs a script with its arguments and returns its output. The script must succeed.
  std::string run(std::vector<std::string> command) const;

 private:
  Npm();
  Folder place_;
  std::string why_not_;
};

/// Returns why rosbag is missing; empty if it is installed.
std::string whyNoRosbag();
/// compression: none, bz2 or lz4.
void writeBag(const std::filesystem::path& plan, const std::filesystem::path& bag,
              const std::string& compression);

}  // namespace perdure::test
