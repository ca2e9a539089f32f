// What `perdure doctor --fix` mends before a drive can be read at all: the tables of a folder in
// EuRoC's layout whose stamps are not nanoseconds, or whose samples have an orientation beside
// them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace perdure::tools {

/// A folder of links to a drive, with its mended tables; gone with this object.
class MendedText {
 public:
  /// Nothing is written where nothing of this kind is to be mended. Throws StartupError(kData)
  /// where a mend is needed and not sure, kUnavailable where the folder cannot be made.
  explicit MendedText(const std::filesystem::path& drive);
  ~MendedText();
  MendedText(const MendedText&) = delete;
  MendedText& operator=(const MendedText&) = delete;

  /// What is to be read: `drive` itself where nothing was mended.
  const std::filesystem::path& drive() const { return drive_; }
  const std::vector<std::string>& mends() const { return mends_; }  ///< a sentence each

 private:
  std::filesystem::path drive_, temporary_;
  std::vector<std::string> mends_;
};

}  // namespace perdure::tools
