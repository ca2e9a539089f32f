// The data.csv of a sensor's folder: a stamp and values per line, sorted by time.
#pragma once

#include <algorithm>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/time.h"
#include "common/replay/files/text_file.h"
#include "common/replay/recording.h"

namespace perdure::replay {

/// Where a row has its stamp, and the unit of the stamp.
struct StampColumn {
  bool last = false;     ///< the last column instead of the first
  bool seconds = false;  ///< seconds with decimals instead of whole nanoseconds
};

struct TableRow {
  std::size_t number = 0;  ///< row number from 0, including skipped rows
  std::size_t line = 0;    ///< line number in the file, from 1
  TimePoint time;
  std::vector<std::string_view> fields;  ///< the first is the stamp, wherever the row has it

  /// Returns whether two rows have the same values apart from the stamp.
  bool isSame(const TableRow& other) const {
    return std::equal(fields.begin() + 1, fields.end(), other.fields.begin() + 1,
                      other.fields.end());
  }
};

class SensorTable {
 public:
  /// Returns the reason why a row cannot be used; "" if it can.
  using Judge = std::function<std::string(const std::vector<std::string_view>& fields)>;

  /// `kind` is the prefix of the reasons counted in `recording`: KIND_malformed,
  /// KIND_not_increasing (a repeated stamp), KIND_stray (a stamp far from those of its neighbours),
  /// KIND_unsorted (rows that were moved). Each repair adds a sentence to the notes in `recording`.
  /// Fields are separated by commas, semicolons or blanks. Throws StartupError(kData) with the
  /// first wrong line if fewer than half of the rows can be used.
  SensorTable(const std::filesystem::path& file, const std::string& kind, Recording& recording,
              const Judge& judge, StampColumn stamp = {});
  SensorTable(const SensorTable&) = delete;  // not copyable, because rows refer to the text
  SensorTable& operator=(const SensorTable&) = delete;

  /// Names of the columns in lower case. The result is empty if the file has no header.
  const std::vector<std::string>& head() const { return head_; }
  /// Rows in order of increasing time.
  const std::vector<TableRow>& rows() const { return rows_; }
  /// Number of rows in the file, including wrong ones.
  std::size_t lines() const { return lines_; }
  bool wasSorted() const { return sorted_; }

 private:
  void takeHead(std::string_view line);

  std::vector<TextLine> text_;
  std::vector<std::string> head_;
  std::vector<TableRow> rows_;
  std::size_t lines_ = 0;
  bool sorted_ = true;
};

}  // namespace perdure::replay
