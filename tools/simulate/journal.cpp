#include "tools/simulate/journal.h"

#include <fmt/format.h>

#include <cstdlib>
#include <optional>
#include <sstream>
#include <string>

#include "common/base/errors.h"

namespace perdure::tools {
namespace {

std::string sidesOf(const Box& box) {
  return fmt::format(" {:a} {:a} {:a} {:a}", box.x1, box.y1, box.x2, box.y2);
}

std::string lineOf(const JournalEntry& entry) {
  std::string line;
  for (const auto& sensor : entry.sensors) {
    line += fmt::format("{} {:a} {:a} ", sensor.frames, sensor.log_exposure, sensor.log_gain);
  }
  line += fmt::format("{}", entry.views.size());
  for (const auto& view : entry.views) {
    line += fmt::format(" {} {:a}", view.object_id, view.visible_fraction) + sidesOf(view.box);
    line += view.inside ? " in" + sidesOf(*view.inside) : " whole";
  }
  return line + " .";
}

/// Reads a hexadecimal number, which streams do not support.
bool take(std::istringstream& line, double& value) {
  std::string word;
  if (!(line >> word)) return false;
  char* end = nullptr;
  value = std::strtod(word.c_str(), &end);
  return *end == '\0';
}

bool take(std::istringstream& line, Box& box) {
  return take(line, box.x1) && take(line, box.y1) && take(line, box.x2) && take(line, box.y2);
}

bool take(std::istringstream& line, sim::TruthView& view) {
  std::string word;
  if (!(line >> view.object_id) || !take(line, view.visible_fraction) || !take(line, view.box) ||
      !(line >> word)) {
    return false;
  }
  return word == "whole" || (word == "in" && take(line, view.inside.emplace()));
}

std::optional<JournalEntry> entryOf(const std::string& text, std::size_t cameras) {
  std::istringstream line(text);
  JournalEntry entry;
  entry.sensors.resize(cameras);
  bool good = true;
  for (auto& s : entry.sensors) {
    good = good && line >> s.frames && take(line, s.log_exposure) && take(line, s.log_gain);
  }
  std::size_t count = 0;
  if (!good || !(line >> count)) return std::nullopt;
  for (std::size_t i = 0; i < count; ++i) {
    sim::TruthView v;
    if (!take(line, v)) return std::nullopt;
    entry.views.push_back(v);
  }
  std::string end;
  return line >> end && end == "." ? std::optional(entry) : std::nullopt;
}

}  // namespace

Journal::Journal(const std::filesystem::path& file, std::size_t cameras,
                 const std::function<bool(std::size_t)>& is_whole)
    : file_(file) {
  std::ifstream old(file_);
  for (std::string text; std::getline(old, text);) {
    const auto entry = entryOf(text, cameras);
    if (!entry || !is_whole(entries_.size())) break;
    entries_.push_back(*entry);
  }
  old.close();
  stream_.open(file_, std::ios::trunc);
  for (const auto& entry : entries_) stream_ << lineOf(entry) << '\n';
  stream_.flush();
  if (!stream_) {
    throw StartupError(ExitCode::kUnavailable,
                       file_.string() + " cannot be written; is the disk full or read-only?");
  }
}

void Journal::append(const JournalEntry& entry) {
  entries_.push_back(entry);
  stream_ << lineOf(entry) << '\n' << std::flush;
  if (!stream_) throw std::runtime_error(file_.string() + " cannot be written; is the disk full?");
}

}  // namespace perdure::tools
