#include "common/replay/sensor_table.h"

#include <fmt/format.h>

#include "common/base/errors.h"
#include "common/replay/files/stamps.h"

namespace perdure::replay {
namespace {

bool beginsNumber(std::string_view text) {
  return !text.empty() && text.find_first_of("0123456789+-.") == 0;
}

std::vector<std::string_view> stampFirst(std::vector<std::string_view> fields, StampColumn stamp) {
  if (stamp.last) std::rotate(fields.begin(), fields.end() - 1, fields.end());
  return fields;
}

std::string whyNoSeconds(std::string_view text) {
  return parseSeconds(text) ? "" : fmt::format("`{}` is no stamp in seconds", text);
}

}  // namespace

SensorTable::SensorTable(const std::filesystem::path& file, const std::string& kind,
                         Recording& recording, const Judge& judge, StampColumn stamp)
    : text_(readLines(file, "it lists the samples or images of a sensor")) {
  std::string first_wrong;
  constexpr std::size_t kFewNegative = 3;
  std::size_t wrong = 0, negative = 0;
  const TextLine* first_negative = nullptr;
  for (const TextLine& line : text_) {
    if (line.text.starts_with('#') || (lines_ == 0 && head_.empty() && !beginsNumber(line.text))) {
      takeHead(line.text);
      continue;
    }
    TableRow row{lines_++, line.number, {}, stampFirst(fieldsOf(line.text), stamp)};
    const auto time = stamp.seconds ? parseSeconds(row.fields[0]) : parseNanoseconds(row.fields[0]);
    const std::string why = time            ? judge(row.fields)
                            : stamp.seconds ? whyNoSeconds(row.fields[0])
                                            : whyNoStamp(row.fields[0]);
    if (!time && parseNumber(row.fields[0]).value_or(0.0) < 0.0) {
      ++negative;
      if (!first_negative) first_negative = &line;
    }
    if (!why.empty()) {
      if (wrong++ == 0) first_wrong = fmt::format("{}:{}: {}", file.c_str(), line.number, why);
      continue;
    }
    row.time = *time;
    rows_.push_back(std::move(row));
  }
  if (first_negative && negative > kFewNegative && 20 * negative > lines_) {
    throw StartupError(
        ExitCode::kData,
        "{}:{}: {} of {} stamps are negative, the first is `{}`; add the same number "
        "to the stamps of all sensors",
        file.c_str(), first_negative->number, negative, lines_,
        stampFirst(fieldsOf(first_negative->text), stamp)[0]);
  }
  if (2 * rows_.size() < lines_) {
    if (wrong == 1) throw StartupError(ExitCode::kData, first_wrong);
    throw StartupError(ExitCode::kData, "{}; so are {} more of {} lines", first_wrong, wrong - 1,
                       lines_);
  }
  const std::string lines = std::to_string(lines_) + " lines";
  if (wrong > 0) {
    recording.reasons.add(kind + "_malformed", wrong);
    recording.notes.push_back(
        fmt::format("{}: {} of {} cannot be read and were left out; the first: {}", file.c_str(),
                    wrong, lines, first_wrong));
  }
  sorted_ = orderByTime(rows_, kind, file.string(), lines, recording, [&](std::size_t i) {
    return fmt::format("{}:{}", file.c_str(), rows_[i].line);
  });
}

void SensorTable::takeHead(std::string_view line) {
  if (!head_.empty() || lines_ > 0) return;
  if (line.starts_with('#')) line.remove_prefix(1);
  for (const auto field : fieldsOf(trim(line))) head_.push_back(toLower(field));
}

}  // namespace perdure::replay
