#include "tools/evaluate/memory/places.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/replay/files/text_file.h"

namespace perdure::tools {
namespace {

constexpr char kPlacesHeader[] = "place,visit,x,y,z,frames";

std::string addRow(const std::string& text, Places& places) {
  const auto fields = replay::split(text, ',');
  if (fields.size() != 6) {
    return std::to_string(fields.size()) + " columns; a row is " + kPlacesHeader;
  }
  const auto place = replay::parseInteger(fields[0]), visit = replay::parseInteger(fields[1]);
  if (!place || !visit || *place < 0 || *visit < 0) {
    return "place and visit are whole numbers from 0";
  }
  const auto p = replay::parseNumbers({fields.begin() + 2, fields.begin() + 5});
  constexpr double kFar_m = 1e7;
  const bool near = p && std::ranges::all_of(*p, [](double x) { return std::abs(x) < kFar_m; });
  if (!near) return "x, y and z are numbers within 1e7 m, with decimal points";
  PlaceVisit row{Eigen::Vector3d(p->data()), {}};
  for (const auto field : replay::split(fields[5], ' ')) {
    const auto frame = replay::parseInteger(field);
    if (!frame || *frame < 0) return "frames are whole numbers from 0 with blanks between them";
    const auto number = static_cast<std::uint64_t>(*frame);
    if (std::ranges::find(row.frames, number) != row.frames.end()) {
      return "frame " + std::to_string(number) + " is named twice";
    }
    row.frames.push_back(number);
  }
  if (row.frames.empty()) return "the visit has no frames; leave the line out";
  auto& visits = places[static_cast<std::uint64_t>(*place)];
  if (visits.emplace(*visit, std::move(row)).second) return "";
  return "an earlier line has this visit of this place; write its frames in one line";
}

/// Offset from the place to the object's centre, along the ray from the body and to its left.
struct ObjectAtPlace {
  std::uint64_t id = 0;
  double along = 0.0, across = 0.0;
};

/// The object nearest to the middle of the limits, in units of their half widths.
std::optional<ObjectAtPlace> objectAt(const Eigen::Vector2d& place_W, const PlaceFrame& frame,
                                      const PlaceOptions& options) {
  const Eigen::Vector2d ray = (place_W - frame.T_WB.p.head<2>()).normalized();
  const double middle = (options.along_m[0] + options.along_m[1]) / 2.0;
  const double half = (options.along_m[1] - options.along_m[0]) / 2.0;
  std::optional<ObjectAtPlace> best;
  double least = 0.0;
  for (const EstimateRow* row : frame.rows) {
    if (!options.class_name.empty() && row->class_name != options.class_name) continue;
    const Eigen::Vector2d d = row->centre_W.head<2>() - place_W;
    const double along = ray.dot(d), across = ray.x() * d.y() - ray.y() * d.x();
    const double a = (along - middle) / half, b = across / options.across_m;
    if (ray.isZero() || !(std::abs(a) < 1.0) || !(std::abs(b) < 1.0)) continue;
    if (best && a * a + b * b >= least) continue;
    best = {row->id, along, across};
    least = a * a + b * b;
  }
  return best;
}

Visit judgeVisit(const PlaceVisit& truth, bool first,
                 const std::map<std::uint64_t, PlaceFrame>& frames, const PlaceOptions& options,
                 PlaceScore& score) {
  Visit visit;
  for (const std::uint64_t number : truth.frames) {
    const auto at = frames.find(number);
    if (at == frames.end()) continue;
    visit.frames.push_back(number);
    const Eigen::Vector2d place_W = (at->second.T_WP * truth.position).head<2>();
    const auto object = objectAt(place_W, at->second, options);
    const double range = (place_W - at->second.T_WB.p.head<2>()).norm();
    if (range >= options.range_m[0] && range <= options.range_m[1]) {
      ++(first ? score.first_asked : score.later_asked);
      (first ? score.first_found : score.later_found) += object ? 1 : 0;
    }
    if (!object) continue;
    ++visit.ids[object->id];
    score.along_m.push_back(object->along);
    score.across_m.push_back(object->across);
  }
  return visit;
}

}  // namespace

Places readPlaces(const std::filesystem::path& file) {
  const auto lines = replay::readLines(file, std::string("--places takes rows ") + kPlacesHeader);
  replay::Complaints wrong(file);
  Places places;
  if (lines.empty() || lines[0].text != kPlacesHeader) {
    wrong.add(1, std::string("the header is ") + kPlacesHeader);
  }
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const std::string error = addRow(lines[i].text, places);
    if (!error.empty()) wrong.add(lines[i].number, error);
  }
  wrong.throwIfAny();
  return places;
}

/// Follows the merges of `id`. Stops at a cycle, which arises if two ids are merged, split, and
/// merged in the other direction.
std::uint64_t RunEvents::finalId(std::uint64_t id) const {
  std::set<std::uint64_t> seen;
  for (auto at = merged.find(id); at != merged.end() && seen.insert(id).second;
       at = merged.find(id)) {
    id = at->second;
  }
  return id;
}

RunEvents readRunEvents(const std::filesystem::path& file) {
  RunEvents events;
  replay::Complaints wrong(file);
  for (const auto& line : replay::readLines(file, "`perdure pipeline` writes events.jsonl")) {
    try {
      const auto json = nlohmann::json::parse(line.text);
      const auto name = json.at("event").get<std::string>();
      ++events.counts[name];
      const auto other = json.value("other_id", std::uint64_t{0});
      if (name == "merged" && other != 0) events.merged[other] = json.at("object_id");
    } catch (const nlohmann::json::exception&) {
      wrong.add(line.number, "no event of `perdure pipeline`");
    }
  }
  wrong.throwIfAny();
  return events;
}

PlaceScore scorePlaces(const Places& places, const std::map<std::uint64_t, PlaceFrame>& frames,
                       const RunEvents& events, const PlaceOptions& options) {
  PlaceScore score;
  for (const auto& [place, visits] : places) {
    std::vector<std::optional<std::uint64_t>> ids;
    for (const auto& [number, truth] : visits) {
      const Visit visit = judgeVisit(truth, number == 0, frames, options, score);
      if (visit.frames.size() >= options.least_frames) ids.push_back(visit.id());
    }
    if (ids.size() < 2) continue;
    ++score.visited_twice;
    const auto a = ids.front(), b = ids.back();
    score.without += a && b ? 0 : 1;
    score.kept_in_visit += a && a == b ? 1 : 0;
    score.kept += a && b && events.finalId(*a) == events.finalId(*b) ? 1 : 0;
  }
  return score;
}

}  // namespace perdure::tools
