#include "common/replay/recordings/unpacked_file.h"

#include <fmt/format.h>
#include <stdlib.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <map>
#include <mutex>
#include <span>
#include <vector>

#include "common/base/algorithms/folder.h"
#include "common/base/errors.h"

namespace perdure::replay {
namespace {

namespace fs = std::filesystem;

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using OpenFile = std::unique_ptr<std::FILE, CloseFile>;

std::string sizeOf(std::uint64_t bytes) {
  const double megabytes = static_cast<double>(bytes) * 1e-6;
  return megabytes < 1000.0 ? fmt::format("{:.1f} MB", megabytes)
                            : fmt::format("{:.1f} GB", megabytes * 1e-3);
}

[[noreturn]] void throwUnusable(const fs::path& packed, const std::string& why) {
  throw StartupError(ExitCode::kUnavailable, packed.string() + " " + why);
}

fs::path newFolder(const fs::path& packed) {
  std::error_code error;
  const fs::path place = fs::temp_directory_path(error);
  std::string name = (place / "perdure-unpacked-XXXXXX").string();
  if (!error && mkdtemp(name.data()) != nullptr) return name;
  throwUnusable(packed,
                "is packed as a whole, and there is no place to unpack it: set TMPDIR to a "
                "folder that can be written");
}

[[noreturn]] void throwFull(const fs::path& packed, const fs::path& to, std::uint64_t size,
                            std::uint64_t came) {
  std::error_code ignored;
  const auto free = fs::space(to.parent_path().parent_path(), ignored).available;
  throwUnusable(packed,
                fmt::format("is packed as a whole; unpacked it takes {}, and {} has {} left: set "
                            "TMPDIR to a folder with more room, or unpack it there: zstd -d",
                            size > 0 ? sizeOf(size) : "more than " + sizeOf(came),
                            to.parent_path().parent_path().string(), sizeOf(free + came)));
}

/// Returns whether the bytes match the start of a zstd frame.
bool looksPacked(std::span<const std::uint8_t> bytes) {
  constexpr std::array<std::uint8_t, 4> kFrame{0x28, 0xB5, 0x2F, 0xFD},
      kSkippable{0x50, 0x2A, 0x4D, 0x18};
  const std::size_t size = std::min(bytes.size(), kFrame.size());
  const auto begins = [&](const auto& magic, std::uint8_t mask) {
    return (bytes[0] & mask) == magic[0] &&
           std::equal(magic.begin() + 1, magic.begin() + static_cast<long>(size),
                      bytes.begin() + 1);
  };
  return begins(kFrame, 0xFF) || begins(kSkippable, 0xF0);
}

}  // namespace

UnpackedFile::UnpackedFile(const fs::path& packed)
    : packed_(packed), path_(newFolder(packed) / packed.stem()) {
  try {
    unpack();
  } catch (...) {
    std::error_code ignored;
    fs::remove_all(path_.parent_path(), ignored);
    throw;
  }
}

UnpackedFile::~UnpackedFile() {
  std::error_code ignored;
  fs::remove_all(path_.parent_path(), ignored);
}

void UnpackedFile::unpack() {
  const OpenFile in(std::fopen(packed_.c_str(), "rb"));
  if (!in) throwUnusable(packed_, std::string("cannot be read: ") + std::strerror(errno));
  std::vector<std::uint8_t> packed(ZSTD_DStreamInSize()), room(ZSTD_DStreamOutSize());
  const auto read = [&] {
    return ZSTD_inBuffer{packed.data(), std::fread(packed.data(), 1, packed.size(), in.get()), 0};
  };
  ZSTD_inBuffer filled = read();
  if (filled.size == 0) {
    throwUnusable(packed_, "is empty; copy it again from where it was recorded");
  }
  if (!looksPacked({packed.data(), filled.size})) {
    throwUnusable(packed_,
                  fmt::format("is not packed by zstd, though its name says so; if it was never "
                              "packed, name it {}",
                              packed_.stem().string()));
  }
  const auto size = ZSTD_getFrameContentSize(packed.data(), filled.size);
  const bool known = size != ZSTD_CONTENTSIZE_UNKNOWN && size != ZSTD_CONTENTSIZE_ERROR;
  const std::uint64_t stated = known ? size : 0;  // stated size of the first compressed frame
  std::error_code unknown;
  const auto space = fs::space(path_.parent_path(), unknown);
  if (!unknown && stated > space.available) throwFull(packed_, path_, stated, 0);
  const OpenFile out(std::fopen(path_.c_str(), "wb"));
  if (!out) throwUnusable(packed_, "cannot be unpacked: " + std::string(std::strerror(errno)));
  const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(ZSTD_createDCtx(),
                                                                     &ZSTD_freeDCtx);
  bool whole = false;
  while (filled.size > 0) {
    ZSTD_outBuffer step{room.data(), room.size(), 0};
    const std::size_t before = filled.pos;
    const std::size_t state = ZSTD_decompressStream(context.get(), &step, &filled);
    if (ZSTD_isError(state) != 0) {
      whole = false;
      break;
    }
    if (step.pos > 0 || filled.pos > before) whole = state == 0;
    const std::size_t written = std::fwrite(room.data(), 1, step.pos, out.get());
    size_ += written;
    if (written < step.pos) throwFull(packed_, path_, stated, size_);
    if (filled.pos == filled.size && step.pos < step.size) filled = read();
  }
  if (std::fflush(out.get()) != 0) throwFull(packed_, path_, stated, size_);
  if (!whole) {
    throwUnusable(packed_, fmt::format("is damaged or cut: {} of it can be unpacked; copy it again "
                                       "from where it was recorded",
                                       sizeOf(size_)));
  }
}

std::string UnpackedFile::note() const {
  return fmt::format("{} is packed as a whole: it was unpacked to {} ({}), which goes at the end",
                     packed_.string(), path_.string(), sizeOf(size_));
}

std::shared_ptr<const UnpackedFile> UnpackedFile::of(const fs::path& packed) {
  static std::mutex mutex;
  static std::map<fs::path, std::weak_ptr<const UnpackedFile>> known;
  const std::lock_guard lock(mutex);
  std::error_code ignored;
  auto& entry = known[fs::weakly_canonical(packed, ignored)];
  if (auto there = entry.lock()) return there;
  auto unpacked = std::make_shared<const UnpackedFile>(packed);
  entry = unpacked;
  return unpacked;
}

bool isPacked(const fs::path& file, std::string_view extension) {
  const auto outer = file.extension();
  return (outer == ".zstd" || outer == ".zst") && file.stem().extension() == extension;
}

std::vector<fs::path> packedFiles(const fs::path& path, std::string_view extension) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) {
    return pathsIn(path, [&](const fs::path& file) {
      return isPacked(file, extension) && !fs::exists(file.parent_path() / file.stem(), ignored);
    });
  }
  return isPacked(path, extension) ? std::vector{path} : std::vector<fs::path>();
}

UnpackedFiles unpackedFiles(const fs::path& path, std::string_view extension) {
  UnpackedFiles files;
  for (const auto& file : packedFiles(path, extension)) files.push_back(UnpackedFile::of(file));
  return files;
}

}  // namespace perdure::replay
