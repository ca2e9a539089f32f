// What a run of the simulator has done so far, so that the next one carries on where it was cut and
// ends with the same bytes. One line a frame, numbers in hexadecimal, exact to the last bit.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <vector>

#include "common/sim/truth.h"
#include "tools/simulate/render/sensor.h"

namespace perdure::tools {

struct JournalEntry {
  std::vector<SensorState> sensors;  ///< after the frame, one of each camera
  std::vector<sim::TruthView> views;
};

class Journal {
 public:
  /// Reads the entries of `file` up to the first that is cut or for whose frame `is_whole` says
  /// false, forgets what follows, and appends from there.
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
