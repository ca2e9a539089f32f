#include "common/base/checked_file.h"

#include <sys/resource.h>

#include <cerrno>
#include <cstring>
#include <string>

#include "common/base/errors.h"

namespace perdure {
namespace {

namespace fs = std::filesystem;

fs::path placeOf(const fs::path& file) {
  std::error_code ignored;
  if (fs::exists(file, ignored) && !fs::is_regular_file(file, ignored)) return file;
  fs::path part = file;
  part += ".part";
  return part;
}

/// How to get room for a file. A limit of this process is as likely a cause as a full disk.
std::string fixOfRoom() {
  const auto limit = fileSizeLimit();
  return limit ? "raise the size limit of files, which is " + std::to_string(*limit) +
                     " bytes (ulimit -f), or free space"
               : "free space, or write to another disk";
}

}  // namespace

CheckedFile::CheckedFile(fs::path file) : file_(std::move(file)), written_(placeOf(file_)) {
  errno = 0;
  stream_.open(written_, std::ios::binary | std::ios::trunc);
  if (stream_) return;
  if (errno == ENOSPC) throwUnwritten(file_);
  throw StartupError(ExitCode::kUnavailable,
                     "{} cannot be written ({}); give --out a folder that you may write",
                     file_.c_str(), std::strerror(errno));
}

CheckedFile::~CheckedFile() {
  if (!stream_.is_open() || written_ == file_) return;
  stream_.close();
  std::error_code ignored;
  fs::remove(written_, ignored);
}

void CheckedFile::close() {
  flushChecked(stream_, file_);
  errno = 0;
  stream_.close();
  std::error_code error;
  if (stream_ && written_ != file_) fs::rename(written_, file_, error);
  if (stream_ && !error) return;
  const std::string why = error ? error.message() : "";
  std::error_code ignored;
  if (written_ != file_) fs::remove(written_, ignored);
  throwUnwritten(file_, why);
}

void writeChecked(const fs::path& file, std::string_view content) {
  CheckedFile checked(file);
  checked.stream().write(content.data(), static_cast<std::streamsize>(content.size()));
  checked.close();
}

void flushChecked(std::ostream& stream, const fs::path& file) {
  const bool failed_before = !stream;
  errno = 0;
  stream.flush();
  if (!stream) throwUnwritten(file, failed_before ? "not all of it could be written" : "");
}

std::optional<std::uint64_t> fileSizeLimit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_FSIZE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return std::nullopt;
  return limit.rlim_cur;
}

void throwUnwritten(const fs::path& file, std::string_view why) {
  std::string reason(why);
  if (reason.empty()) reason = errno != 0 ? std::strerror(errno) : "not all of it could be written";
  throw StartupError(ExitCode::kInputOutput, "{}: {}; {}: the results are not whole", file.c_str(),
                     reason, fixOfRoom());
}

}  // namespace perdure
