#include "common/replay/files/sensor_table.h"

#include <algorithm>

#include "common/base/errors.h"
#include "common/replay/files/stamps.h"

namespace perdure::replay {
namespace {

bool beginsNumber(std::string_view text) {
  return !text.empty() && text.find_first_of("0123456789+-.") == 0;
}

}  // namespace

SensorTable::SensorTable(const std::filesystem::path& file, const std::string& kind,
                         const Judge& judge)
    : file_(file),
      kind_(kind),
      text_(readLines(file, "EuRoC keeps data.csv in each sensor's folder")) {
  read(judge);
  order();
}

void SensorTable::read(const Judge& judge) {
  std::string first_wrong;
  std::size_t wrong = 0;
  for (const TextLine& line : text_) {
    if (line.text.starts_with('#') || (lines_ == 0 && head_.empty() && !beginsNumber(line.text))) {
      takeHead(line.text);
      continue;
    }
    TableRow row{lines_++, {}, fieldsOf(line.text)};
    const auto time = parseNanoseconds(row.fields[0]);
    const std::string why = time ? judge(row.fields) : whyNoStamp(row.fields[0]);
    if (!why.empty()) {
      if (wrong++ == 0)
        first_wrong = file_.string() + ":" + std::to_string(line.number) + ": " + why;
      continue;
    }
    row.time = *time;
    rows_.push_back(std::move(row));
  }
  if (wrong == 0) return;
  if (2 * rows_.size() < lines_) {
    throw StartupError(
        ExitCode::kData,
        first_wrong + (wrong > 1 ? "; so are " + std::to_string(wrong - 1) + " more of " +
                                       std::to_string(lines_) + " lines"
                                 : ""));
  }
  reasons_.add(kind_ + "_malformed", wrong);
  note(wrong, "cannot be read and were left out; the first: " + first_wrong);
}

void SensorTable::takeHead(std::string_view line) {
  if (!head_.empty() || lines_ > 0) return;
  if (line.starts_with('#')) line.remove_prefix(1);
  for (const auto field : fieldsOf(trim(line))) head_.push_back(toLower(field));
}

void SensorTable::order() {
  std::vector<TimePoint> stamps;
  for (const TableRow& row : rows_) stamps.push_back(row.time);
  const StampOrder order = orderOf(stamps);
  std::vector<TableRow> rows;
  for (const std::size_t i : order.kept) rows.push_back(std::move(rows_[i]));
  rows_ = std::move(rows);
  const auto count = [this](const char* what, std::size_t n) {
    if (n > 0) reasons_.add(kind_ + what, n);
  };
  count("_not_increasing", order.repeated);
  count("_stray", order.strays);
  count("_unsorted", order.moved);
  note(order.strays, "have a stamp far from their neighbours' and were left out");
  note(order.moved, "were not in the order of their stamps and were sorted");
}

void SensorTable::note(std::size_t count, const std::string& what) {
  if (count == 0) return;
  notes_.push_back(file_.string() + ": " + std::to_string(count) + " of " + std::to_string(lines_) +
                   " lines " + what);
}

}  // namespace perdure::replay
