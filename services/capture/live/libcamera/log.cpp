#include "services/capture/live/libcamera/log.h"

#include <libcamera/logging.h>

namespace perdure::capture {

std::optional<std::string> worthLogging(std::string_view line) {
  for (int i = 0; i < 2 && line.starts_with('['); ++i) {
    const auto end = line.find("] ");
    if (end == std::string_view::npos) break;
    line.remove_prefix(end + 2);
  }
  while (line.ends_with('\n')) line.remove_suffix(1);
  const bool quiet = line.starts_with(" INFO ") || line.starts_with("DEBUG ");
  while (line.starts_with(' ')) line.remove_prefix(1);
  if (quiet || line.empty()) return std::nullopt;
  return std::string(line);
}

LibcameraLog::LibcameraLog(std::function<void(const std::string&)> log) : lines_(std::move(log)) {
  libcamera::logSetStream(&stream_, false);
}

LibcameraLog::~LibcameraLog() { libcamera::logSetTarget(libcamera::LoggingTargetNone); }

std::streamsize LibcameraLog::Lines::xsputn(const char* text, std::streamsize length) {
  if (const auto line = worthLogging({text, static_cast<std::size_t>(length)})) log_(*line);
  return length;
}

}  // namespace perdure::capture
