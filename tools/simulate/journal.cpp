#include "tools/simulate/journal.h"

#include <nlohmann/json.hpp>
#include <string>

#include "common/base/checked_file.h"
#include "common/base/errors.h"

namespace perdure::tools {
namespace {

using Json = nlohmann::json;

Json sidesOf(const Box& box) { return {box.x1, box.y1, box.x2, box.y2}; }

Box boxOf(const Json& sides) { return {sides.at(0), sides.at(1), sides.at(2), sides.at(3)}; }

std::string lineOf(const JournalEntry& entry) {
  Json sensors = Json::array(), views = Json::array();
  for (const auto& sensor : entry.sensors) {
    sensors.push_back({sensor.frames, sensor.log_exposure, sensor.log_gain});
  }
  for (const auto& view : entry.views) {
    views.push_back({view.object_id, view.visible_fraction, sidesOf(view.box)});
    if (view.inside) views.back().push_back(sidesOf(*view.inside));
  }
  return Json{sensors, views}.dump();
}

/// Parses a line of the journal. Throws Json::exception if the line is truncated.
JournalEntry entryOf(const std::string& text, std::size_t cameras) {
  const Json line = Json::parse(text);
  JournalEntry entry;
  for (std::size_t i = 0; i < cameras; ++i) {
    const Json& sensor = line.at(0).at(i);
    entry.sensors.push_back({sensor.at(0), sensor.at(1), sensor.at(2)});
  }
  for (const Json& view : line.at(1)) {
    entry.views.push_back({view.at(0), view.at(1), boxOf(view.at(2)), {}});
    if (view.size() > 3) entry.views.back().inside = boxOf(view.at(3));
  }
  return entry;
}

}  // namespace

Journal::Journal(const std::filesystem::path& file, std::size_t cameras,
                 const std::function<bool(std::size_t)>& is_whole)
    : file_(file) {
  std::ifstream old(file_);
  for (std::string text; std::getline(old, text);) {
    try {
      const JournalEntry entry = entryOf(text, cameras);
      if (!is_whole(entries_.size())) break;
      entries_.push_back(entry);
    } catch (const Json::exception&) {
      break;
    }
  }
  old.close();
  stream_.open(file_, std::ios::trunc);
  for (const auto& entry : entries_) stream_ << lineOf(entry) << '\n';
  stream_.flush();
  if (!stream_) throwUnwritten(file_);
}

void Journal::append(const JournalEntry& entry) {
  entries_.push_back(entry);
  stream_ << lineOf(entry) << '\n' << std::flush;
  if (!stream_) throwUnwritten(file_);
}

}  // namespace perdure::tools
