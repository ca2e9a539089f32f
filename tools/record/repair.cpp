// `perdure record repair`.
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <optional>
#include <system_error>

#include "common/base/errors.h"
#include "common/replay/recordings/mcap_reader.h"
#include "common/replay/recordings/unpacked_file.h"
#include "tools/record/files.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
namespace mcap = replay::mcap;

bool isFull(const std::error_code& error) {
  return error == std::errc::no_space_on_device || error.value() == EDQUOT;
}

/// Copies a file and returns the copy's path when the copy is synchronised to the disk. A failed
/// copy is removed.
fs::path copyOf(const fs::path& file) {
  fs::path copy = file;
  copy += ".before-repair";
  std::error_code error, ignored;
  if (fs::exists(fs::symlink_status(copy, ignored))) {
    throw StartupError(ExitCode::kUnavailable,
                       fmt::format("{} stays as it is: what is cut off would be kept in {}, which "
                                   "is there already; move that one away",
                                   file.string(), copy.string()));
  }
  fs::copy_file(file, copy, error);
  if (!error) {
    const int made = open(copy.c_str(), O_RDONLY | O_CLOEXEC);
    if (made < 0 || fsync(made) != 0) error.assign(errno, std::generic_category());
    if (made >= 0) close(made);
  }
  if (!error) return copy;
  fs::remove(copy, ignored);
  throw StartupError(isFull(error) ? ExitCode::kInputOutput : ExitCode::kUnavailable,
                     fmt::format("{} stays as it is: a copy of it cannot be kept in {} ({}); free "
                                 "some room, or copy the file to another disk and repair it there",
                                 file.string(), copy.string(), error.message()));
}

[[noreturn]] void refuse(const fs::path& file, const std::string& why) {
  throw StartupError(ExitCode::kUnavailable, file.string() + " " + why);
}

void refuseDamaged(const fs::path& file, const mcap::Reader& reader) {
  if (reader.damage().empty()) return;
  throw StartupError(
      ExitCode::kData,
      "{}; this cannot be repaired, and the file is not changed: {} messages of it are read",
      mcap::sentenceOfDamage(file, reader), reader.statistics().messages);
}

void finish(const fs::path& file, mcap::Reader& reader) {
  std::optional<fs::path> copy;
  if (reader.cutBytes() > 0) copy = copyOf(file);
  const auto finished = reader.finish();
  if (finished) {
    fmt::print("{} is whole again: {} chunks, {} messages", file.string(), reader.chunks().size(),
               reader.statistics().messages);
    if (copy) {
      fmt::print("; {} bytes at its end were no whole chunk, and the file as it was is {}",
                 reader.cutBytes(), copy->string());
    }
    fmt::print("\n");
    if (!reader.damage().empty())
      fmt::print("{}; they are left out\n", mcap::sentenceOfDamage(file, reader));
    return;
  }
  if (copy) fs::rename(*copy, file);
  const ExitCode code = mcap::exitCodeOf(finished.error());
  throw StartupError(code, finished.error().detail + "; it stays as it was");
}

void repair(const fs::path& file) {
  if (replay::isPacked(file, ".mcap")) {
    throw StartupError(ExitCode::kUsage, fmt::format("{} is packed as a whole; unpack it first: "
                                                     "zstd -d {}, then repair what comes of it",
                                                     file.string(), file.string()));
  }
  auto reader = mcap::Reader::open(file);
  if (!reader) throw StartupError(ExitCode::kUnavailable, reader.error().detail);
  if (reader->size() == 0) refuse(file, "is empty: nothing can be made whole");
  reader->check();
  if (reader->finished()) {
    refuseDamaged(file, *reader);
    return fmt::print("{} is whole\n", file.string());
  }
  if (reader->chunks().empty()) {
    refuseDamaged(file, *reader);
    refuse(file, fmt::format("holds no whole chunk: its {} bytes cannot be made a recording, and "
                             "it stays as it is",
                             reader->cutBytes()));
  }
  if (const auto can = reader->finishable(); !can) {
    throw StartupError(ExitCode::kUnavailable, can.error().detail);
  }
  finish(file, *reader);
}

std::vector<fs::path> filesOf(const fs::path& path) {
  if (!fs::is_directory(path)) return {path};
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(path)) {
    if (entry.path().extension() == ".mcap") files.push_back(entry.path());
  }
  std::ranges::sort(files);
  return files;
}

}  // namespace

void repairAll(const std::vector<fs::path>& paths) {
  std::optional<StartupError> refused;
  for (const fs::path& path : paths) {
    for (const fs::path& file : filesOf(path)) {
      try {
        repair(file);
      } catch (const StartupError& error) {
        if (refused) fmt::print(stderr, "{}\n", refused->what());
        refused = error;
      }
    }
  }
  std::fflush(stdout);
  if (refused) throw StartupError(*refused);
}

}  // namespace perdure::tools
