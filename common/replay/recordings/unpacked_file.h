// A file compressed by zstd as a whole: by rosbag2 with `compression_mode: FILE`, or manually.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace perdure::replay {

/// Unpacks a file into a temporary folder in $TMPDIR (/tmp). The folder is deleted with this
/// object, but remains if the process is killed.
class UnpackedFile {
 public:
  /// Returns a shared object, because a recording is opened for each of its cameras. Throws
  /// StartupError with the fix: no space, damaged or truncated, empty, not compressed, not
  /// readable.
  static std::shared_ptr<const UnpackedFile> of(const std::filesystem::path& packed);
  explicit UnpackedFile(const std::filesystem::path& packed);
  ~UnpackedFile();
  UnpackedFile(const UnpackedFile&) = delete;
  UnpackedFile& operator=(const UnpackedFile&) = delete;

  const std::filesystem::path& path() const { return path_; }
  const std::filesystem::path& packed() const { return packed_; }
  /// A note for users: source, target and size.
  std::string note() const;

 private:
  void unpack();
  std::filesystem::path packed_, path_;
  std::uint64_t size_ = 0;
};

/// Returns whether the name is that of a compressed file with this extension: "run_0.db3.zstd" or
/// "run_0.db3.zst".
bool isPacked(const std::filesystem::path& file, std::string_view extension);
/// `path` itself, or the compressed files of a folder that have no unpacked file beside them;
/// sorted by name.
std::vector<std::filesystem::path> packedFiles(const std::filesystem::path& path,
                                               std::string_view extension);
using UnpackedFiles = std::vector<std::shared_ptr<const UnpackedFile>>;
/// All of packedFiles(), unpacked. Throws like UnpackedFile::of.
UnpackedFiles unpackedFiles(const std::filesystem::path& path, std::string_view extension);

}  // namespace perdure::replay
