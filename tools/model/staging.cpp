#include "tools/model/staging.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>

#include "common/base/checked_file.h"
#include "common/base/errors.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

constexpr const char* kElsewhere = "give --out a folder that you may write";

fs::path nearestThatExists(fs::path folder) {
  std::error_code error;
  while (folder.has_relative_path() && !fs::exists(folder, error)) folder = folder.parent_path();
  return folder;
}

void throwUnplaced(const fs::path& file, const std::error_code& error) {
  if (error == std::errc::no_space_on_device) throwUnwritten(file, error.message());
  throw StartupError(ExitCode::kUnavailable,
                     file.string() + " cannot be written (" + error.message() + "); " + kElsewhere);
}

}  // namespace

TemporaryFolder temporaryFolder(const fs::path& parent, const std::string& prefix,
                                const std::string& fix) {
  return {parent / prefix, [&](const std::string&) {
            const int why = errno;
            if (why == ENOSPC || why == EDQUOT) throwUnwritten(parent, std::strerror(why));
            throw StartupError(ExitCode::kUnavailable, "nothing can be written into {} ({}); {}",
                               parent.string(), std::strerror(why), fix);
          }};
}

Staging::Staging(fs::path folder)
    : folder_(std::move(folder)),
      waiting_(temporaryFolder(nearestThatExists((fs::current_path() / folder_).lexically_normal()),
                               ".perdure-import-", kElsewhere)) {}

std::string Staging::said(std::string message) const {
  const std::string hidden = (path() / "").string(), shown = (folder_ / "").string();
  for (auto at = message.find(hidden); at != std::string::npos;
       at = message.find(hidden, at + shown.size())) {
    message.replace(at, hidden.size(), shown);
  }
  return message;
}

std::vector<Staging::Move> Staging::moves() const {
  std::vector<Move> moves;
  for (const auto& file : fs::directory_iterator(path())) {
    const fs::path to = folder_ / file.path().filename();
    std::error_code error;
    const auto there = fs::symlink_status(to, error);
    if (fs::is_directory(to, error)) {
      throw StartupError(ExitCode::kUnavailable,
                         to.string() + " is a folder; move it, or give another --out");
    }
    moves.push_back({file.path(), to, fs::exists(there) ? file.path().string() + ".former" : ""});
  }
  std::ranges::sort(moves, {}, &Move::to);
  return moves;
}

void Staging::carryOut(const Move& move) {
  std::error_code error;
  if (!move.former.empty()) fs::rename(move.to, move.former, error);
  if (!error) fs::rename(move.from, move.to, error);
  if (error) throwUnplaced(move.to, error);
}

void Staging::takeBack(const Move& move) {
  std::error_code ignored;
  if (!fs::exists(move.from, ignored)) fs::rename(move.to, move.from, ignored);
  if (fs::exists(fs::symlink_status(move.former, ignored))) {
    fs::rename(move.former, move.to, ignored);
  }
}

void Staging::publish() {
  const auto all = moves();
  std::error_code error;
  if (!folder_.empty()) fs::create_directories(folder_, error);
  if (error) throwUnplaced(folder_, error);
  for (std::size_t i = 0; i < all.size(); ++i) {
    try {
      carryOut(all[i]);
    } catch (...) {
      for (std::size_t back = i + 1; back-- > 0;) takeBack(all[back]);
      throw;
    }
  }
}

}  // namespace perdure::tools
