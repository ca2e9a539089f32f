// libcamera's own lines, without colours, in our log.
#pragma once

#include <functional>
#include <optional>
#include <ostream>
#include <streambuf>
#include <string>
#include <string_view>

namespace perdure::capture {

/// What is worth saying of a line of libcamera's, "[time] [thread] LEVEL Category file:line words":
/// warnings and worse, from the level on. libcamera 0.0.3 cannot be told so for all categories.
std::optional<std::string> worthLogging(std::string_view line);

/// libcamera's target as long as it lives; none after that. `log` is called on any thread.
class LibcameraLog {
 public:
  explicit LibcameraLog(std::function<void(const std::string&)> log);
  ~LibcameraLog();
  LibcameraLog(const LibcameraLog&) = delete;
  LibcameraLog& operator=(const LibcameraLog&) = delete;

 private:
  /// libcamera writes a line at once, and from several threads: nothing is kept between writes.
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
