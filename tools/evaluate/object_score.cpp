#include "tools/evaluate/object_score.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/math/so3.h"

namespace perdure::tools {
namespace {

constexpr double kNear_m = 1.5, kSameBox = 0.5;

struct Match {
  std::size_t truth = 0, estimate = 0;
  double distance = 0.0;
};

bool mayBe(const Estimate& estimate, const TruthLabel& label) {
  return label.class_name.empty() || label.class_name == estimate.class_name;
}

/// Matches pairs within distance d and angle a one-to-one, greedily by increasing distance.
std::vector<Match> matchGreedily(const std::vector<TruthLabel>& truth,
                                 const std::vector<Estimate>& estimates, double d, double angle) {
  std::vector<Match> pairs;
  for (std::size_t t = 0; t < truth.size(); ++t) {
    for (std::size_t e = 0; e < estimates.size(); ++e) {
      const double distance = (truth[t].centre - estimates[e].centre).norm();
      const double turn = std::abs(wrapAngle(truth[t].heading - estimates[e].heading));
      const bool close_in_angle = angle >= std::numbers::pi || turn < angle;
      if (!mayBe(estimates[e], truth[t])) continue;
      if (distance < d && close_in_angle) pairs.push_back({t, e, distance});
    }
  }
  std::ranges::stable_sort(pairs, {}, &Match::distance);
  std::vector<bool> truth_used(truth.size()), estimate_used(estimates.size());
  std::vector<Match> matches;
  for (const Match& pair : pairs) {
    if (truth_used[pair.truth] || estimate_used[pair.estimate]) continue;
    truth_used[pair.truth] = estimate_used[pair.estimate] = true;
    matches.push_back(pair);
  }
  return matches;
}

double shareInside(const Box& box, const Box& region) {
  const double w = std::min(box.x2, region.x2) - std::max(box.x1, region.x1);
  const double h = std::min(box.y2, region.y2) - std::max(box.y1, region.y1);
  return box.area() > 0 && w > 0 && h > 0 ? w * h / box.area() : 0.0;
}

double bestOverlap(const Box& box, const std::vector<TruthLabel>& labels) {
  double best = 0.0;
  for (const auto& label : labels) best = std::max(best, intersectionOverUnion(box, label.box));
  return best;
}

struct Track {
  std::uint64_t counted = 0, matched = 0, unmatched_since = 0;
  std::uint64_t last_id = 0;
  std::set<std::uint64_t> ids, ids_near;
};

void followIdentities(const std::vector<Match>& matches, const std::vector<Estimate>& estimates,
                      const TruthFrame& truth, std::map<std::int64_t, Track>& tracks,
                      ObjectScore& score) {
  std::vector<std::optional<std::uint64_t>> id_of(truth.counted.size());
  for (const Match& match : matches) id_of[match.truth] = estimates[match.estimate].id;
  for (std::size_t t = 0; t < truth.counted.size(); ++t) {
    Track& track = tracks[truth.counted[t].track];
    ++track.counted;
    if (!id_of[t]) {
      ++track.unmatched_since;
      continue;
    }
    if (track.matched > 0 && track.last_id != *id_of[t]) ++score.id_switches;
    if (track.matched > 0 && track.unmatched_since > 0) ++score.interruptions;
    track.unmatched_since = 0;
    track.last_id = *id_of[t];
    track.ids.insert(*id_of[t]);
    track.ids_near.insert(*id_of[t]);
    ++track.matched;
  }
}

void summarise(const std::map<std::int64_t, Track>& tracks, const ScoreOptions& options,
               ObjectScore& score) {
  score.objects = tracks.size();
  double recalls = 0.0;
  for (const auto& [id, track] : tracks) {
    if (track.matched > 0) ++score.objects_found;
    score.ids_matched += track.ids.size();
    if (track.matched > 0) score.ids_near += track.ids_near.size();
    score.minutes += static_cast<double>(track.counted) * options.frame_interval_s / 60.0;
    recalls += static_cast<double>(track.matched) / static_cast<double>(track.counted);
  }
  score.mean_object_recall = tracks.empty() ? 1.0 : recalls / static_cast<double>(tracks.size());
  const auto matched = static_cast<double>(score.cells[2][2].matched);
  if (matched > 0) score.position_error_m /= matched;
}

/// Counts one frame for one pair of thresholds; `neutral` marks the neutral estimates.
void countCell(const std::vector<Match>& matches, std::size_t truths,
               const std::vector<bool>& neutral, bool strict, Cell& cell) {
  std::vector<bool> used(neutral.size());
  for (const Match& match : matches) {
    used[match.estimate] = true;
    cell.distance_m += match.distance;
  }
  cell.matched += matches.size();
  cell.truth += truths;
  for (std::size_t e = 0; e < neutral.size(); ++e) {
    if (!used[e] && (strict || !neutral[e])) ++cell.false_alarms;
  }
}

/// The counted true object nearest to the estimate; null if none is within kNear_m.
const TruthLabel* nearestCounted(const Estimate& estimate, const TruthFrame& truth) {
  const TruthLabel* nearest = nullptr;
  double best = kNear_m;
  for (const auto& label : truth.counted) {
    const double distance = (label.centre - estimate.centre).norm();
    if (distance < best) best = distance, nearest = &label;
  }
  return nearest;
}

void countUnmatched(const std::vector<Match>& matches, const std::vector<Estimate>& estimates,
                    const std::vector<bool>& neutral, const TruthFrame& truth,
                    std::map<std::int64_t, Track>& tracks, ObjectScore& score) {
  std::vector<bool> used(estimates.size());
  for (const Match& match : matches) {
    used[match.estimate] = true;
    score.position_error_m += match.distance;
  }
  for (std::size_t e = 0; e < estimates.size(); ++e) {
    if (used[e]) continue;
    if (neutral[e]) {
      ++score.neutral;
    } else if (const TruthLabel* label = nearestCounted(estimates[e], truth)) {
      ++score.duplicates;
      tracks[label->track].ids_near.insert(estimates[e].id);
    }
  }
}

double nearestLabel(const Eigen::Vector3d& centre, const TruthFrame& truth) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto* labels : {&truth.counted, &truth.ignored}) {
    for (const auto& label : *labels) nearest = std::min(nearest, (label.centre - centre).norm());
  }
  return nearest;
}

void noteMishaps(std::uint64_t frame, const std::vector<Match>& matches,
                 const std::vector<Estimate>& estimates, const std::vector<bool>& neutral,
                 const TruthFrame& truth, std::vector<Mishap>& mishaps) {
  std::set<std::size_t> truths, used;
  for (const Match& match : matches) {
    truths.insert(match.truth);
    used.insert(match.estimate);
  }
  for (std::size_t e = 0; e < estimates.size(); ++e) {
    if (neutral[e] || used.contains(e)) continue;
    mishaps.push_back({frame, false, static_cast<std::int64_t>(estimates[e].id),
                       estimates[e].centre, nearestLabel(estimates[e].centre, truth)});
  }
  for (std::size_t t = 0; t < truth.counted.size(); ++t) {
    if (truths.contains(t)) continue;
    double nearest = std::numeric_limits<double>::infinity();
    for (const auto& estimate : estimates) {
      nearest = std::min(nearest, (truth.counted[t].centre - estimate.centre).norm());
    }
    mishaps.push_back({frame, true, truth.counted[t].track, truth.counted[t].centre, nearest});
  }
}

}  // namespace

double Cell::recall() const {
  return truth == 0 ? 1.0 : static_cast<double>(matched) / static_cast<double>(truth);
}

double Cell::positionError() const {
  return matched == 0 ? 0.0 : distance_m / static_cast<double>(matched);
}

double ObjectScore::idsPerFound() const {
  return objects_found == 0 ? 1.0
                            : static_cast<double>(ids_near) / static_cast<double>(objects_found);
}

double Cell::precision() const {
  const std::uint64_t claimed = matched + false_alarms;
  return claimed == 0 ? 1.0 : static_cast<double>(matched) / static_cast<double>(claimed);
}

bool isNeutral(const Estimate& estimate, const TruthFrame& truth) {
  double overlap = bestOverlap(estimate.box, truth.ignored);
  bool belongs = overlap >= kSameBox;
  for (const auto& label : truth.ignored) {
    belongs = belongs || (label.centre - estimate.centre).norm() < kNear_m;
  }
  for (const auto& region : truth.dont_care) {
    const double share = shareInside(estimate.box, region);
    belongs = belongs || share >= kSameBox;
    overlap = std::max(overlap, share);
  }
  return belongs && bestOverlap(estimate.box, truth.counted) <= overlap;
}

ObjectScore scoreFrames(const std::map<std::uint64_t, ScoredFrame>& frames,
                        const ScoreOptions& options) {
  ObjectScore score;
  std::map<std::int64_t, Track> tracks;
  for (const auto& [frame, scored] : frames) {
    const TruthFrame& truth = scored.truth;
    const auto& estimates = scored.estimates;
    std::vector<bool> neutral;
    for (const auto& estimate : estimates) neutral.push_back(isNeutral(estimate, truth));
    std::vector<Match> matches;
    for (std::size_t d = 0; d < 3; ++d) {
      for (std::size_t a = 0; a < 3; ++a) {
        matches = matchGreedily(truth.counted, estimates, kDistances_m[d],
                                kAngles_deg[a] * std::numbers::pi / 180.0);
        countCell(matches, truth.counted.size(), neutral, options.strict, score.cells[d][a]);
      }
    }
    followIdentities(matches, estimates, truth, tracks, score);
    countUnmatched(matches, estimates, neutral, truth, tracks, score);
    noteMishaps(frame, matches, estimates, neutral, truth, score.mishaps);
  }
  summarise(tracks, options, score);
  return score;
}

std::optional<Estimate> toCamera(const EstimateRow& row, const RigidTransform& T_RW,
                                 const replay::KittiCalibration& calibration) {
  constexpr double kClosest = 0.1;  // least depth in m; corners behind it are moved to it
  const auto project = [&](const Eigen::Vector3d& point) -> Eigen::Vector2d {
    const Eigen::Vector3d front(point.x(), point.y(), std::max(point.z(), kClosest));
    const Eigen::Vector3d pixel = calibration.P2 * front.homogeneous();
    return pixel.head<2>() / pixel.z();
  };
  const double width = calibration.width, height = calibration.height;
  Estimate estimate;
  estimate.id = row.id;
  estimate.class_name = row.class_name;
  estimate.centre = T_RW * row.centre_W;
  if (estimate.centre.z() < kClosest) return std::nullopt;
  const Eigen::Vector2d centre = project(estimate.centre);
  if (centre.x() < 0 || centre.y() < 0 || centre.x() >= width || centre.y() >= height) {
    return std::nullopt;
  }
  const Eigen::Vector3d forward = T_RW.q * Eigen::Vector3d(std::cos(row.yaw), std::sin(row.yaw), 0);
  estimate.heading = std::atan2(-forward.z(), forward.x());
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Box box{kInfinity, kInfinity, -kInfinity, -kInfinity};
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d half(corner & 1 ? 0.5 : -0.5, corner & 2 ? 0.5 : -0.5,
                               corner & 4 ? 0.5 : -0.5);
    const Eigen::Vector3d size(row.length, row.width, row.height);
    const Eigen::Vector3d offset = rotationAboutZ(row.yaw) * half.cwiseProduct(size);
    const Eigen::Vector2d pixel = project(T_RW * (row.centre_W + offset));
    box.x1 = std::min(box.x1, pixel.x()), box.x2 = std::max(box.x2, pixel.x());
    box.y1 = std::min(box.y1, pixel.y()), box.y2 = std::max(box.y2, pixel.y());
  }
  estimate.box = Box{std::clamp(box.x1, 0.0, width), std::clamp(box.y1, 0.0, height),
                     std::clamp(box.x2, 0.0, width), std::clamp(box.y2, 0.0, height)};
  return estimate;
}

ObjectScore scoreObjects(const std::vector<EstimateRow>& rows,
                         const std::map<std::uint64_t, TruthFrame>& truth,
                         const PosesByFrame& poses, const replay::KittiCalibration& calibration,
                         const ScoreOptions& options) {
  std::map<std::uint64_t, ScoredFrame> frames;
  std::uint64_t outside = 0;
  for (const auto& [frame, labels] : truth) frames[frame].truth = labels;
  for (const auto& row : rows) {
    const auto pose = poses.find(row.frame);
    std::optional<Estimate> estimate;
    if (pose != poses.end()) {
      estimate = toCamera(row, calibration.T_RI * pose->second.inverse(), calibration);
    }
    if (estimate)
      frames[row.frame].estimates.push_back(*estimate);
    else
      ++outside;
  }
  ObjectScore score = scoreFrames(frames, options);
  score.outside = outside;
  return score;
}

}  // namespace perdure::tools
