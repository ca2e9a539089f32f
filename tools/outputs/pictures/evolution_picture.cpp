#include "tools/outputs/pictures/evolution_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "common/base/algorithms/median.h"
#include "tools/base/quantile.h"
#include "tools/outputs/pictures/chart.h"
#include "tools/outputs/pictures/drawing.h"

namespace perdure::tools {
namespace {

constexpr double kSameThing = 3.0;  // largest distance between object and truth, m
constexpr int kWidth = 1500, kRow = 190, kTop = 66, kBottom = 56;
constexpr int kLeft = 84, kBetween = 90, kRight = 24;
constexpr int kBodyRow = 300;
const Colour kHiddenShade(150, 150, 235), kOutShade(190, 190, 190);

struct Seen {
  TimePoint time;
  Eigen::Vector3d p_W;
};
struct Candidate {
  Evolution evolution;
  std::vector<Seen> seen;  ///< frames in which the object is visible
  bool confirmed = false;
};

Phase phaseOf(const ObjectGlance& object) {
  return object.inSight() ? Phase::kInSight : object.hidden() ? Phase::kHidden : Phase::kOutOfView;
}

std::map<ObjectId, Candidate> candidatesOf(const DriveLog& log) {
  std::map<ObjectId, Candidate> all;
  for (const auto& [index, frame] : log.frames()) {
    for (const ObjectGlance& object : frame.objects) {
      Candidate& one = all[object.id];
      one.evolution.id = object.id;
      one.evolution.class_name = object.class_name;
      one.confirmed = one.confirmed || object.confirmed;
      if (object.inSight()) one.seen.push_back({frame.stamp.time, object.p_W});
    }
  }
  std::erase_if(all, [](const auto& entry) { return !entry.second.confirmed; });
  return all;
}

std::vector<const Candidate*> chosen(const std::map<ObjectId, Candidate>& all, std::size_t most) {
  std::vector<const Candidate*> by_length, firsts, rest;
  for (const auto& [id, one] : all) by_length.push_back(&one);
  std::ranges::stable_sort(
      by_length, [](const auto* a, const auto* b) { return a->seen.size() > b->seen.size(); });
  std::set<std::string> classes;
  for (const Candidate* one : by_length) {
    const std::string& name = one->evolution.class_name;
    (name != kOtherClass && classes.insert(name).second ? firsts : rest).push_back(one);
  }
  firsts.insert(firsts.end(), rest.begin(), rest.end());
  if (firsts.size() > most) firsts.resize(most);
  return firsts;
}

/// Median distance between object and true track (m). Empty if the true track was absent in more
/// than half of the frames in which the object was visible.
std::optional<double> medianDistance(const Candidate& one, const TruthTrack& track) {
  std::vector<double> distances;
  for (const Seen& seen : one.seen) {
    const auto key = track.at(seen.time);
    if (key) distances.push_back((key->centre_W - seen.p_W).norm());
  }
  if (distances.empty() || 2 * distances.size() < one.seen.size()) return std::nullopt;
  return medianOf(std::move(distances));
}

/// Pairs objects and true tracks, the smallest distance first. Each is in at most one pair.
std::map<ObjectId, const TruthTrack*> pairs(const std::map<ObjectId, Candidate>& all,
                                            const PictureTruth* truth) {
  struct Pair {
    double distance;
    ObjectId id;
    const TruthTrack* track;
  };
  std::vector<Pair> near;
  for (const auto& [id, one] : all) {
    if (truth == nullptr) break;
    for (const TruthTrack& track : truth->objects) {
      const auto distance = medianDistance(one, track);
      if (distance && *distance < kSameThing) near.push_back({*distance, id, &track});
    }
  }
  std::ranges::stable_sort(near, {}, &Pair::distance);
  std::map<ObjectId, const TruthTrack*> matched;
  std::set<const TruthTrack*> used;
  for (const Pair& pair : near) {
    if (matched.contains(pair.id) || !used.insert(pair.track).second) continue;
    matched[pair.id] = pair.track;
  }
  return matched;
}

void fillPoints(const DriveLog& log, Evolution& evolution, const TruthTrack* track) {
  for (const auto& [index, frame] : log.frames()) {
    const auto object = std::ranges::find(frame.objects, evolution.id, &ObjectGlance::id);
    if (object == frame.objects.end()) continue;
    EvolutionPoint point{index, std::sqrt(std::max(0.0, object->p_covariance.trace())),
                         std::nullopt, object->existence, phaseOf(*object)};
    const auto key = track != nullptr ? track->at(frame.stamp.time) : std::nullopt;
    if (key) point.error = (key->centre_W - object->p_W).norm();
    evolution.points.push_back(point);
  }
}

void shadePhases(Chart& chart, const Evolution& evolution) {
  const auto& points = evolution.points;
  for (std::size_t i = 0; i < points.size();) {
    std::size_t end = i;
    while (end < points.size() && points[end].phase == points[i].phase) ++end;
    const double to = static_cast<double>(points[std::min(end, points.size() - 1)].frame);
    const double from = static_cast<double>(points[i].frame);
    if (points[i].phase == Phase::kHidden) chart.shade(from, to, kHiddenShade, 0.55);
    if (points[i].phase == Phase::kOutOfView) chart.shade(from, to, kOutShade, 0.35);
    i = end;
  }
}

/// Draws the curve of f(point). Frames without a value, and gaps, interrupt the curve.
template <class Value>
void drawSeries(Chart& chart, const Evolution& evolution, const Stroke& stroke, Value&& value) {
  constexpr std::uint64_t kGap = 5;
  std::vector<cv::Point2d> points;
  std::uint64_t last = 0;
  const auto end = [&] {
    chart.drawCurve(points, stroke);
    points.clear();
  };
  for (const EvolutionPoint& point : evolution.points) {
    const std::optional<double> y = value(point);
    if (!points.empty() && (!y || point.frame > last + kGap)) end();
    if (y) points.emplace_back(static_cast<double>(point.frame), *y);
    last = point.frame;
  }
  end();
}

/// Upper end of the error axis (m); ignores the largest twentieth of the values.
double topOf(const Evolution& evolution) {
  std::vector<double> values;
  for (const auto& point : evolution.points) {
    values.push_back(point.sigma);
    if (point.error) values.push_back(*point.error);
  }
  if (values.empty()) return 1.0;
  return std::max(0.1, 1.15 * sampleAt(std::move(values), 0.95));
}

void drawRow(cv::Mat& picture, int top, const Evolution& evolution, const Chart::Range& frames,
             bool last) {
  const int y = top + 26, height = kRow - 44;
  const int width = (kWidth - kLeft - kBetween - kRight) / 2;
  const Colour colour = classColour(evolution.class_name);
  Chart left(picture, {kLeft, y, width, height}, frames, {0.0, topOf(evolution)});
  Chart right(picture, {kLeft + width + kBetween, y, width, height}, frames, {0.0, 1.05});
  for (Chart* chart : {&left, &right}) {
    shadePhases(*chart, evolution);
    chart->drawGrid(last);
  }
  drawSeries(left, evolution, {mixed(colour, kPaper, 0.25), 2, true, 6.0, 5.0},
             [](const EvolutionPoint& p) { return std::optional(p.sigma); });
  drawSeries(left, evolution, {kTruthColour, 2}, [](const EvolutionPoint& p) { return p.error; });
  drawSeries(right, evolution, {colour, 2},
             [](const EvolutionPoint& p) { return std::optional(p.existence); });
  drawText(picture, fmt::format("{} {}", evolution.class_name, evolution.id), {kLeft, y - 7},
           colour * 0.8, {0.6, 2});
  drawText(picture, "position, m", {kLeft + width - 86, y - 7}, kInk, {0.42});
  drawText(picture, "existence", {kWidth - kRight - 68, y - 7}, kInk, {0.42});
}

void drawLegend(cv::Mat& picture, int top, bool with_truth) {
  int x = kLeft;
  const auto entry = [&](const std::string& text, const auto& sign) {
    sign(cv::Point(x, top + 26));
    drawText(picture, text, {x + 40, top + 31}, kInk, {0.5});
    x += 40 + sizeOf(text, {0.5}).width + 34;
  };
  const auto line = [&](const Stroke& stroke) {
    return [&picture, stroke](const cv::Point& p) {
      drawLine(picture, {p, p + cv::Point(32, 0)}, stroke);
    };
  };
  const auto patch = [&](const Colour& colour, double opacity) {
    return [&picture, colour, opacity](const cv::Point& p) {
      tint(picture, {p.x, p.y - 9, 32, 18}, colour, opacity);
    };
  };
  if (with_truth) entry("error against truth", line({kTruthColour, 2}));
  entry("standard deviation", line({kInk, 2, true, 6.0, 5.0}));
  entry("hidden", patch(kHiddenShade, 0.55));
  entry("out of view", patch(kOutShade, 0.35));
}

}  // namespace

std::vector<Evolution> chooseEvolutions(const DriveLog& log, const PictureTruth* truth,
                                        std::size_t most) {
  const auto all = candidatesOf(log);
  const auto matched = pairs(all, truth);
  std::vector<Evolution> result;
  for (const Candidate* one : chosen(all, most)) {
    result.push_back(one->evolution);
    const auto track = matched.find(one->evolution.id);
    fillPoints(log, result.back(), track == matched.end() ? nullptr : track->second);
  }
  return result;
}

cv::Mat drawEvolutions(const std::vector<Evolution>& evolutions, const BodyErrors& body) {
  const int rows = static_cast<int>(evolutions.size());
  const int above = body.points.empty() ? 0 : kBodyRow;
  cv::Mat picture(above + kTop + rows * kRow + kBottom, kWidth, CV_8UC3, kPaper);
  Chart::Range frames{1e18, -1e18};
  bool with_truth = false;
  for (const Evolution& one : evolutions) {
    for (const EvolutionPoint& point : one.points) {
      frames.low = std::min(frames.low, static_cast<double>(point.frame));
      frames.high = std::max(frames.high, static_cast<double>(point.frame));
      with_truth = with_truth || point.error.has_value();
    }
  }
  for (const BodyErrors::Point& point : body.points) {
    frames.low = std::min(frames.low, static_cast<double>(point.frame));
    frames.high = std::max(frames.high, static_cast<double>(point.frame));
  }
  if (above > 0) {
    const cv::Rect area(kLeft, 48, kWidth - kLeft - kRight, above - 90);
    drawBodyErrors(picture, area, body, frames);
  }
  drawLegend(picture, above, with_truth);
  for (int row = 0; row < rows; ++row) {
    drawRow(picture, above + kTop + row * kRow, evolutions[static_cast<std::size_t>(row)], frames,
            row + 1 == rows);
  }
  drawText(picture, "frame", {kWidth / 2 - 20, picture.rows - 16}, kInk, {0.5});
  return picture;
}

bool writeEvolution(const DriveLog& log, const PictureTruth* truth, const BodyErrors& body,
                    const std::filesystem::path& file) {
  const auto evolutions = chooseEvolutions(log, truth, 5);
  if (evolutions.empty() && body.points.empty()) return false;
  writePicture(drawEvolutions(evolutions, body), file);
  return true;
}

}  // namespace perdure::tools
