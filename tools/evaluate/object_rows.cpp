#include "tools/evaluate/object_rows.h"

#include <algorithm>
#include <cmath>

#include "common/base/errors.h"
#include "common/replay/files/text_file.h"

namespace perdure::tools {
namespace {

constexpr char kHeader[] =
    "sequence,frame,timestamp_ns,object_id,class,score,x,y,z,l,w,h,yaw,visible";

std::optional<EstimateRow> readRow(const std::string& text) {
  const auto fields = replay::split(text, ',');
  if (fields.size() != 14) return std::nullopt;
  const auto frame = replay::parseInteger(fields[1]);
  const auto time = replay::parseInteger(fields[2]);
  const auto id = replay::parseInteger(fields[3]);
  const auto v = replay::parseNumbers({fields.begin() + 5, fields.begin() + 13});
  if (!frame || *frame < 0 || !time || !id || *id < 0 || !v) return std::nullopt;
  EstimateRow row;
  row.frame = static_cast<std::uint64_t>(*frame);
  row.time = fromNanoseconds(*time);
  row.id = static_cast<std::uint64_t>(*id);
  row.class_name = replay::toLower(fields[4]);
  row.score = (*v)[0];
  row.centre_W = Eigen::Vector3d((*v)[1], (*v)[2], (*v)[3]);
  row.length = (*v)[4], row.width = (*v)[5], row.height = (*v)[6], row.yaw = (*v)[7];
  return row;
}

using Ties = std::vector<std::pair<std::size_t, std::uint64_t>>;  // trajectory row and frame

Ties tieLines(const std::vector<replay::StampedPose>& poses, const std::vector<EstimateRow>& rows) {
  std::map<TimePoint, std::uint64_t> frame_at;
  for (const auto& row : rows) frame_at[row.time] = row.frame;
  Ties ties;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto found = frame_at.find(poses[i].time);
    if (found != frame_at.end()) ties.emplace_back(i, found->second);
  }
  return ties;
}

std::optional<std::uint64_t> multipleOfTenth(TimePoint time) {
  const std::int64_t tenth = 100'000'000, ns = toNanoseconds(time);
  if (ns < 0 || ns % tenth != 0) return std::nullopt;
  return static_cast<std::uint64_t>(ns / tenth);
}

/// The frame of trajectory row i, from the nearest ties; without ties, from its time.
std::optional<std::uint64_t> frameOf(std::size_t i, const std::vector<replay::StampedPose>& poses,
                                     const Ties& ties) {
  if (ties.empty()) return multipleOfTenth(poses[i].time).value_or(i);
  const auto after = std::ranges::lower_bound(ties, i, {}, &Ties::value_type::first);
  if (after != ties.end() && after->first == i) return after->second;
  const auto& b = after == ties.end() ? ties.back() : *after;
  const auto& a = after == ties.begin() ? b : *(after - 1);
  const auto steps = [](std::size_t from, std::size_t to) {
    return static_cast<std::int64_t>(to) - static_cast<std::int64_t>(from);
  };
  std::int64_t frame = static_cast<std::int64_t>(a.second) + steps(a.first, i);
  const bool between = a.first < i && i < b.first;
  if (between && b.second - a.second != b.first - a.first) {
    const double span = toSeconds(poses[b.first].time - poses[a.first].time);
    const double s = toSeconds(poses[i].time - poses[a.first].time) / span;
    frame = static_cast<std::int64_t>(a.second) +
            std::llround(s * static_cast<double>(b.second - a.second));
  }
  if (frame < 0) return std::nullopt;
  return static_cast<std::uint64_t>(frame);
}

}  // namespace

std::vector<EstimateRow> readObjectRows(const std::filesystem::path& file) {
  const auto lines = replay::readLines(file, "`perdure pipeline` writes objects_final.csv");
  replay::Complaints wrong(file);
  if (lines.empty() || lines[0].text != kHeader) {
    wrong.add(1, std::string("the header is ") + kHeader);
    wrong.throwIfAny();
  }
  std::vector<EstimateRow> rows;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const auto row = readRow(lines[i].text);
    if (row)
      rows.push_back(*row);
    else
      wrong.add(lines[i].number, std::string("a row is ") + kHeader);
  }
  wrong.throwIfAny();
  return rows;
}

std::map<std::uint64_t, RigidTransform> posesByFrame(
    const std::vector<replay::StampedPose>& poses, const std::vector<EstimateRow>& rows,
    const std::optional<std::set<std::uint64_t>>& used) {
  Ties ties = tieLines(poses, rows);
  const bool all = !used || ties.empty();
  std::vector<std::uint64_t> numbers;
  if (!all) {
    numbers.assign(used->begin(), used->end());
    std::erase_if(ties, [&](const auto& tie) { return !used->contains(tie.second); });
    for (auto& tie : ties) {
      const auto at = std::ranges::lower_bound(numbers, tie.second);
      tie.second = static_cast<std::uint64_t>(at - numbers.begin());
    }
  }
  std::map<std::uint64_t, RigidTransform> result;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto frame = frameOf(i, poses, ties);
    if (!frame || (!all && *frame >= numbers.size())) continue;
    result.emplace(all ? *frame : numbers[*frame], poses[i].T_WB);
  }
  return result;
}

}  // namespace perdure::tools
