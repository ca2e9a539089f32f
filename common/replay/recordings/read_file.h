// A file that is read at any position. Internal to common/replay.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "common/base/process/descriptor.h"
#include "common/base/result.h"

namespace perdure::replay {

class ReadFile {
 public:
  /// Opens a file. Reason: "file".
  static Result<ReadFile> open(const std::filesystem::path& path);

  const std::filesystem::path& path() const { return path_; }
  std::uint64_t size() const { return size_; }
  /// Returns fewer bytes if the file ends earlier or cannot be read.
  std::vector<std::uint8_t> read(std::uint64_t at, std::uint64_t length) const;
  /// Closes the file; from now on read() opens it for each call.
  void letGo() { file_.close(); }

 private:
  std::filesystem::path path_;
  Descriptor file_;
  std::uint64_t size_ = 0;
};

}  // namespace perdure::replay
