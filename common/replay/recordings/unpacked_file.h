// A file that is packed by zstd as a whole, as rosbag2 packs with `compression_mode: FILE`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

namespace perdure::replay {

/// Unpacked into a folder of its own in $TMPDIR (/tmp); both go with this object. Who is killed
/// leaves them there.
class UnpackedFile {
 public:
  /// What all share that have it at a time: a recording is opened for each of its cameras. Throws
  /// StartupError with the mend: no room, damaged or cut, not readable.
  static std::shared_ptr<const UnpackedFile> of(const std::filesystem::path& packed);
  explicit UnpackedFile(const std::filesystem::path& packed);
  ~UnpackedFile();
  UnpackedFile(const UnpackedFile&) = delete;
  UnpackedFile& operator=(const UnpackedFile&) = delete;

  const std::filesystem::path& path() const { return path_; }
  /// For people: from where to where, and how large.
  std::string note() const;

 private:
  void unpack();
  std::filesystem::path packed_, path_;
  std::uint64_t size_ = 0;
};

}  // namespace perdure::replay
