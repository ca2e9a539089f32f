#include "tools/record/segment_folder.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <linux/magic.h>
#include <sys/statfs.h>
#include <sys/statvfs.h>

#include <charconv>

#include "common/base/checked_file.h"
#include "common/base/errors.h"
#include "common/replay/recordings/mcap_reader.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPrefix = "perdure-";
constexpr char kExtension[] = ".mcap";

/// The number in the name of a segment; 0 for other files.
std::uint64_t numberOf(const fs::path& file) {
  const std::string name = file.filename().string();
  if (!name.starts_with(kPrefix) || file.extension() != kExtension) return 0;
  std::uint64_t number = 0;
  std::from_chars(name.data() + kPrefix.size(), name.data() + name.size(), number);
  return number;
}

}  // namespace

SegmentFolder::SegmentFolder(const fs::path& folder, std::uint64_t quota, std::uint64_t keep_free)
    : folder_(folder), lock_(folder), quota_(quota), keep_free_(keep_free) {
  findFiles();
}

void SegmentFolder::findFiles() {
  for (const auto& entry : fs::directory_iterator(folder_)) {
    const std::uint64_t number = numberOf(entry.path());
    if (number == 0) continue;
    next_number_ = std::max(next_number_, number + 1);
    auto reader = replay::mcap::Reader::open(entry.path());
    if (reader && !reader->finished() && reader->finish()) repaired_.push_back(entry.path());
    std::error_code ignored;
    sizes_[entry.path()] = fs::file_size(entry.path(), ignored);
  }
}

fs::path SegmentFolder::nextFile(std::int64_t wall_ns, const std::string& word) {
  const auto seconds = static_cast<std::time_t>(wall_ns / 1'000'000'000);
  const fs::path file =
      folder_ / fmt::format("{}{:06}-{:%Y%m%dT%H%M%SZ}{}{}", kPrefix, next_number_++,
                            fmt::gmtime(seconds), word, kExtension);
  sizes_[file] = 0;
  return file;
}

std::uint64_t SegmentFolder::bytes() const {
  std::uint64_t sum = 0;
  for (const auto& [file, size] : sizes_) sum += size;
  return sum;
}

void SegmentFolder::remove(const fs::path& file) {
  std::error_code ignored;
  fs::remove(file, ignored);
  sizes_.erase(file);
}

void SegmentFolder::keepQuota() {
  while (quota_ > 0 && sizes_.size() > 1 && bytes() > quota_) {
    remove(fs::path(sizes_.begin()->first));
    ++removed_;
  }
}

std::uint64_t SegmentFolder::largestFile() const {
  constexpr std::uint64_t kLargestOfFat = 0xFFFF'FFFF;
  struct statfs disk {};
  const bool fat = statfs(folder_.c_str(), &disk) == 0 && disk.f_type == MSDOS_SUPER_MAGIC;
  return std::min(fat ? kLargestOfFat : UINT64_MAX, fileSizeLimit().value_or(UINT64_MAX));
}

bool SegmentFolder::hasRoomFor(std::uint64_t bytes) const {
  struct statvfs disk {};
  if (keep_free_ == 0 || statvfs(folder_.c_str(), &disk) != 0) {
    return true;  // the write will report the error
  }
  return std::uint64_t{disk.f_bavail} * disk.f_frsize >= bytes + keep_free_;
}

}  // namespace perdure::tools
