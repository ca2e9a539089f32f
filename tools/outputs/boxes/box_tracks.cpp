#include "tools/outputs/boxes/box_tracks.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

namespace perdure::tools {
namespace {

class BoxTracks {
 public:
  explicit BoxTracks(const FrameGlances& frames) : all_(extentOf(frames)) {
    constexpr std::uint64_t kLongest = 5;  // frames without boxes that do not end a track
    std::uint64_t last = 0;
    for (const auto& [number, frame] : frames) {
      if (number > last + kLongest) finish();
      if (frame.detections.empty()) continue;
      add(number, frame.detections);
      last = number;
    }
    finish();
  }
  std::vector<BoxTrack> whole() && { return std::move(whole_); }

 private:
  void add(std::uint64_t frame, const std::vector<DetectionGlance>& detections) {
    std::vector<BoxTrack> next;
    for (const auto& one : detections) {
      if (isCut(one.box)) continue;
      BoxTrack track = take(one.box);
      track.push_back({frame, one.box, one.best_class});
      if (track.size() == kMostBoxViews) whole_.push_back(std::exchange(track, {}));
      if (!track.empty()) next.push_back(std::move(track));
    }
    finish();
    open_ = std::move(next);
  }

  bool isCut(const Box& box) const {
    constexpr double kBorder = 0.01;  // share of the extent
    const double across = kBorder * all_.width(), down = kBorder * all_.height();
    return box.x1 < all_.x1 + across || box.y1 < all_.y1 + down || box.x2 > all_.x2 - across ||
           box.y2 > all_.y2 - down;
  }

  /// Returns the track that the box continues, or an empty one.
  BoxTrack take(const Box& box) {
    constexpr double kOverlap = 0.4;
    const auto overlap = [&](const BoxTrack& track) {
      return intersectionOverUnion(track.back().box, box);
    };
    const auto best = std::ranges::max_element(open_, {}, overlap);
    if (best == open_.end() || overlap(*best) < kOverlap) return {};
    BoxTrack track = std::move(*best);
    open_.erase(best);
    return track;
  }

  void finish() {
    for (BoxTrack& track : open_) {
      if (track.size() >= kLeastBoxViews) whole_.push_back(std::move(track));
    }
    open_.clear();
  }

  Box all_;
  std::vector<BoxTrack> open_, whole_;
};

struct CentreView {
  RigidTransform T_CW;
  Eigen::Vector2d at;  ///< centre, normalised image coordinates
  double size = 0.0;   ///< √area of the box in the same unit
};

Eigen::Matrix2Xd unexplained(std::size_t views) {
  return Eigen::Matrix2Xd::Constant(2, static_cast<Eigen::Index>(views), kWorstDeviation);
}

Eigen::Matrix2Xd deviationsFromPoint(const std::vector<CentreView>& views) {
  constexpr double kUnit_m = 10.0, kBehind = -1e-2;
  const RigidTransform T_WM = views[views.size() / 2].T_CW.inverse();
  std::vector<Eigen::Matrix<double, 3, 4>> all;
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  for (const CentreView& view : views) {
    const RigidTransform T_CM = view.T_CW * T_WM;
    auto& P = all.emplace_back();
    P << T_CM.R(), T_CM.p / kUnit_m;
    const Eigen::Matrix<double, 2, 4> rows = view.at * P.row(2) - P.topRows<2>();
    normal += rows.transpose() * rows;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(normal);
  const Eigen::Vector4d v = solver.eigenvectors().col(0);
  const Eigen::Vector4d X = v.z() < 0.0 ? -v : v;
  Eigen::Matrix2Xd deviations(2, static_cast<Eigen::Index>(views.size()));
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Eigen::Vector3d p = all[i] * X;
    if (p.z() <= 0.0 || X.w() < kBehind) return unexplained(views.size());
    deviations.col(static_cast<Eigen::Index>(i)) =
        (p.head<2>() / p.z() - views[i].at) / views[i].size;
  }
  return deviations;
}

}  // namespace

Box extentOf(const FrameGlances& frames) {
  constexpr double kFar = 1e9;
  Box all{kFar, kFar, -kFar, -kFar};
  for (const auto& [number, frame] : frames) {
    for (const auto& one : frame.detections) {
      all = {std::min(all.x1, one.box.x1), std::min(all.y1, one.box.y1),
             std::max(all.x2, one.box.x2), std::max(all.y2, one.box.y2)};
    }
  }
  return all;
}

std::vector<BoxTrack> tracksOf(const FrameGlances& frames) { return BoxTracks(frames).whole(); }

std::optional<Eigen::Matrix2Xd> deviationsOf(const BoxTrack& track, const BoxChange& change,
                                             const FrameGlances& frames,
                                             const CameraModel& camera) {
  std::vector<CentreView> views;
  for (const auto& [number, box, best_class] : track) {
    const std::int64_t right =
        change.times * static_cast<std::int64_t>(number) / change.per + change.shift;
    const auto frame = frames.find(static_cast<std::uint64_t>(right));
    if (right < 0 || frame == frames.end() || !frame->second.has_objects) continue;
    const Eigen::Vector2d centre(0.5 * (box.x1 + box.x2), 0.5 * (box.y1 + box.y2));
    const auto at = camera.unproject(change.A * centre + change.b);
    if (!at) return unexplained(track.size());
    views.push_back({(frame->second.T_WB * camera.T_BC()).inverse(), *at,
                     std::sqrt(box.area() * std::abs(change.A.determinant())) / camera.fx()});
  }
  if (views.size() < kLeastBoxViews) return std::nullopt;
  return deviationsFromPoint(views);
}

double residualOf(const Eigen::Matrix2Xd& deviations) {
  return std::min(kWorstDeviation,
                  std::sqrt(deviations.squaredNorm() / static_cast<double>(deviations.cols())));
}

}  // namespace perdure::tools
