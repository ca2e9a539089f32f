// A file that is packed by zstd as a whole: by rosbag2 with `compression_mode: FILE`, or by hand.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace perdure::replay {

/// Unpacked into a folder of its own in $TMPDIR (/tmp); both go with this object. Who is killed
/// leaves them there.
class UnpackedFile {
 public:
  /// What all share that have it at a time: a recording is opened for each of its cameras. Throws
  /// StartupError with the mend: no room, damaged or cut, empty, not packed, not readable.
  static std::shared_ptr<const UnpackedFile> of(const std::filesystem::path& packed);
  explicit UnpackedFile(const std::filesystem::path& packed);
  ~UnpackedFile();
  UnpackedFile(const UnpackedFile&) = delete;
  UnpackedFile& operator=(const UnpackedFile&) = delete;

  const std::filesystem::path& path() const { return path_; }
  const std::filesystem::path& packed() const { return packed_; }
  /// For people: from where to where, and how large.
  std::string note() const;

 private:
  void unpack();
  std::filesystem::path packed_, path_;
  std::uint64_t size_ = 0;
};

/// "run_0.db3.zstd" or .zst: whether it is packed, and what it holds has this extension.
bool isPacked(const std::filesystem::path& file, std::string_view extension);
/// `path` itself, or of a folder those that nobody has unpacked beside; by name.
std::vector<std::filesystem::path> packedFiles(const std::filesystem::path& path,
                                               std::string_view extension);
using UnpackedFiles = std::vector<std::shared_ptr<const UnpackedFile>>;
/// All of packedFiles, unpacked. Throws as UnpackedFile::of.
UnpackedFiles unpackedFiles(const std::filesystem::path& path, std::string_view extension);

}  // namespace perdure::replay
