// Passes libcamera's log lines, without colours, to this program's log.
#pragma once

#include <functional>
#include <optional>
#include <ostream>
#include <streambuf>
#include <string>
#include <string_view>

namespace perdure::capture {

/// For a line "[time] [thread] LEVEL Category file:line words" of libcamera, returns the text from
/// LEVEL on if the level is warning or more severe; otherwise nothing. libcamera 0.0.3 cannot set
/// this level for all categories.
std::optional<std::string> worthLogging(std::string_view line);

/// Receives libcamera's log during the lifetime of this object. `log` may be called on any thread.
class LibcameraLog {
 public:
  explicit LibcameraLog(std::function<void(const std::string&)> log);
  ~LibcameraLog();
  LibcameraLog(const LibcameraLog&) = delete;
  LibcameraLog& operator=(const LibcameraLog&) = delete;

 private:
  /// Receives libcamera's lines. libcamera writes whole lines from several threads, so nothing is
  /// stored between writes.
  class Lines : public std::streambuf {
   public:
    explicit Lines(std::function<void(const std::string&)> log) : log_(std::move(log)) {}

   protected:
    std::streamsize xsputn(const char* text, std::streamsize length) override;
    int overflow(int c) override { return c; }

   private:
    const std::function<void(const std::string&)> log_;
  };

  Lines lines_;
  std::ostream stream_{&lines_};
};

}  // namespace perdure::capture
