// Passes libcamera's log lines, without colours, to this program's log.
#pragma once

#include <functional>
#include <optional>
#include <ostream>
#include <streambuf>
#include <string>
#include <string_view>

namespace perdure::capture {

/// A libcamera line "[time] [thread] LEVEL …" from its level on, if it is a warning or worse.
std::optional<std::string> worthLogging(std::string_view line);

/// Receives libcamera's log during the lifetime of this object. `log` may be called on any thread.
class LibcameraLog {
 public:
  explicit LibcameraLog(std::function<void(const std::string&)> log);
  ~LibcameraLog();
  LibcameraLog(const LibcameraLog&) = delete;
  LibcameraLog& operator=(const LibcameraLog&) = delete;

 private:
  /// libcamera writes whole lines from several threads, so nothing is stored between writes.
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
