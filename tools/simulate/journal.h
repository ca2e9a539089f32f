// Journal of rendered frames, one line of JSON per frame, from which the next run continues.
#pragma once

#include <filesystem>
#include <fstream>
#include <functional>
#include <vector>

#include "common/sim/truth.h"
#include "tools/simulate/render/sensor.h"

namespace perdure::tools {

struct JournalEntry {
  std::vector<SensorState> sensors;  ///< states after the frame, one for each camera
  std::vector<sim::TruthView> views;
};

class Journal {
 public:
  /// Reads the entries of `file` up to the first that is truncated or whose frame fails `is_whole`.
  /// Discards the rest; new entries are appended there.
  Journal(const std::filesystem::path& file, std::size_t cameras,
          const std::function<bool(std::size_t)>& is_whole);
  const std::vector<JournalEntry>& entries() const { return entries_; }
  void append(const JournalEntry& entry);

 private:
  std::filesystem::path file_;
  std::vector<JournalEntry> entries_;
  std::ofstream stream_;
};

}  // namespace perdure::tools
