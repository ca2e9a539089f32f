// Where a run writes its results: an earlier run's in the same folder stay until they are whole.
#pragma once

#include <filesystem>

namespace perdure::tools {

/// A folder that holds no run is written directly. One that does gets a folder `unfinished`, whose
/// files take the earlier ones' places when the run has ended; without that it is removed.
class ResultsFolder {
 public:
  /// Throws StartupError(kUnavailable) where what a killed run left cannot be removed.
  explicit ResultsFolder(std::filesystem::path out);
  ResultsFolder(const ResultsFolder&) = delete;
  ResultsFolder& operator=(const ResultsFolder&) = delete;
  ~ResultsFolder();

  /// Where to write.
  const std::filesystem::path& folder() const { return written_; }
  /// Once nobody has a file in it open. Throws StartupError(kInputOutput) where it cannot.
  void keep();

 private:
  std::filesystem::path out_, written_;
};

}  // namespace perdure::tools
