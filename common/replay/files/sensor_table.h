// data.csv of a sensor's folder: a stamp and values a line, read line by line, brought into order.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/base/time.h"
#include "common/replay/files/text_file.h"

namespace perdure::replay {

struct TableRow {
  std::size_t number = 0;  ///< among the rows, from 0, those that are left out counted too
  TimePoint time;
  std::vector<std::string_view> fields;  ///< the first is the stamp
};

class SensorTable {
 public:
  /// Why a row cannot be used; "" where it can.
  using Judge = std::function<std::string(const std::vector<std::string_view>& fields)>;

  /// `kind` begins the reasons that are counted: KIND_malformed, KIND_not_increasing (a stamp that
  /// was there before), KIND_stray (its stamp is far from its neighbours'), KIND_unsorted (rows
  /// that were moved). Fields are separated by commas, semicolons or blanks. Throws
  /// StartupError(kData) with the first line that is wrong where fewer than half of the rows can be
  /// used.
  SensorTable(const std::filesystem::path& file, const std::string& kind, const Judge& judge);
  SensorTable(const SensorTable&) = delete;  // rows point into it
  SensorTable& operator=(const SensorTable&) = delete;

  /// Names of the columns, small letters; empty where the file has no head.
  const std::vector<std::string>& head() const { return head_; }
  /// By time, which increases.
  const std::vector<TableRow>& rows() const { return rows_; }
  /// How many the file has, wrong ones too.
  std::size_t lines() const { return lines_; }
  bool wasSorted() const { return reasons_.of(kind_ + "_unsorted") == 0; }
  const ReasonCounts& reasons() const { return reasons_; }
  /// What was mended, a sentence each.
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  void read(const Judge& judge);
  void takeHead(std::string_view line);
  void order();
  void note(std::size_t count, const std::string& what);

  std::filesystem::path file_;
  std::string kind_;
  std::vector<TextLine> text_;
  std::vector<std::string> head_;
  std::vector<TableRow> rows_;
  std::size_t lines_ = 0;
  ReasonCounts reasons_;
  std::vector<std::string> notes_;
};

}  // namespace perdure::replay
