#include "tools/outputs/box_motion.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <utility>
#include <vector>

#include "common/base/algorithms/median.h"
#include "common/camera/camera_model.h"

namespace perdure::tools {
namespace {

using Frames = std::map<std::uint64_t, FrameGlance>;
/// Boxes of one object, with their frames.
using Chain = std::vector<std::pair<std::uint64_t, Box>>;

constexpr std::size_t kLeastViews = 8, kMostViews = 20;
constexpr double kWorst = 10.0;  ///< residual of a chain that no point explains

/// The correction of a possible error.
struct Change {
  Doubt doubt;
  Eigen::Vector4d A{1, 0, 0, 1};  ///< right pixel = [A0 A1; A2 A3] · given pixel + b
  Eigen::Vector2d b{0, 0};
  std::int64_t times = 1, shift = 0;  ///< right frame number = times · given number + shift
};

/// The smallest and largest coordinates of all boxes.
Box extentOf(const Frames& frames) {
  constexpr double kFar = 1e9;
  Box all{kFar, kFar, -kFar, -kFar};
  for (const auto& [number, frame] : frames) {
    for (const auto& [box, probability] : frame.detections) {
      all = {std::min(all.x1, box.x1), std::min(all.y1, box.y1), std::max(all.x2, box.x2),
             std::max(all.y2, box.y2)};
    }
  }
  return all;
}

/// Follows boxes from frame to frame by their overlap.
class Chains {
 public:
  explicit Chains(const Frames& frames) : all_(extentOf(frames)) {
    for (const auto& [number, frame] : frames) add(number, frame.detections);
    finish();
  }
  const std::vector<Chain>& whole() const { return whole_; }

 private:
  void add(std::uint64_t frame, const std::vector<DetectionGlance>& detections) {
    std::vector<Chain> next;
    for (const auto& [box, probability] : detections) {
      if (isCut(box)) continue;
      Chain chain = take(box);
      chain.emplace_back(frame, box);
      if (chain.size() == kMostViews) whole_.push_back(std::exchange(chain, {}));
      if (!chain.empty()) next.push_back(std::move(chain));
    }
    finish();
    open_ = std::move(next);
  }

  /// The centre of a box that the border cuts off moves with the visible part.
  bool isCut(const Box& box) const {
    constexpr double kBorder = 0.01;  // share of the extent
    const double across = kBorder * all_.width(), down = kBorder * all_.height();
    return box.x1 < all_.x1 + across || box.y1 < all_.y1 + down || box.x2 > all_.x2 - across ||
           box.y2 > all_.y2 - down;
  }

  /// Returns the chain that the box continues, or an empty one.
  Chain take(const Box& box) {
    constexpr double kOverlap = 0.4;
    const auto overlap = [&](const Chain& c) {
      return intersectionOverUnion(c.back().second, box);
    };
    const auto best = std::ranges::max_element(open_, {}, overlap);
    if (best == open_.end() || overlap(*best) < kOverlap) return {};
    Chain chain = std::move(*best);
    open_.erase(best);
    return chain;
  }

  void finish() {
    for (Chain& chain : open_) {
      if (chain.size() >= kLeastViews) whole_.push_back(std::move(chain));
    }
    open_.clear();
  }

  Box all_;
  std::vector<Chain> open_, whole_;
};

struct View {
  RigidTransform T_CW;
  Eigen::Vector2d at;  ///< centre, normalised image coordinates
  double size = 0.0;   ///< √area of the box in the same unit
};

/// Returns the RMS distance of the centres from the best common point, in sizes of the boxes.
double residualOf(const std::vector<View>& views) {
  constexpr double kUnit_m = 10.0, kBehind = -1e-2;
  const RigidTransform T_WM = views[views.size() / 2].T_CW.inverse();
  std::vector<Eigen::Matrix<double, 3, 4>> all;
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  for (const View& view : views) {
    const RigidTransform T_CM = view.T_CW * T_WM;
    auto& P = all.emplace_back();
    P << T_CM.R(), T_CM.p / kUnit_m;
    const Eigen::Matrix<double, 2, 4> rows = view.at * P.row(2) - P.topRows<2>();
    normal += rows.transpose() * rows;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(normal);
  const Eigen::Vector4d v = solver.eigenvectors().col(0);
  const Eigen::Vector4d X = v.z() < 0.0 ? -v : v;
  double sum = 0.0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Eigen::Vector3d p = all[i] * X;
    if (p.z() <= 0.0 || X.w() < kBehind) return kWorst;
    sum += ((p.head<2>() / p.z() - views[i].at) / views[i].size).squaredNorm();
  }
  return std::min(kWorst, std::sqrt(sum / static_cast<double>(views.size())));
}

/// Returns nothing if too few of the frames have poses.
std::optional<double> residualAfter(const Change& change, const Chain& chain, const Frames& frames,
                                    const CameraModel& camera) {
  const Eigen::Matrix2d A{{change.A(0), change.A(1)}, {change.A(2), change.A(3)}};
  std::vector<View> views;
  for (const auto& [number, box] : chain) {
    const std::int64_t right = change.times * static_cast<std::int64_t>(number) + change.shift;
    const auto frame = frames.find(static_cast<std::uint64_t>(right));
    if (right < 0 || frame == frames.end() || !frame->second.has_objects) continue;
    const Eigen::Vector2d centre(0.5 * (box.x1 + box.x2), 0.5 * (box.y1 + box.y2));
    const auto at = camera.unproject(A * centre + change.b);
    if (!at) return kWorst;
    views.push_back({(frame->second.T_WB * camera.T_BC()).inverse(), *at,
                     std::sqrt(box.area() * std::abs(A.determinant())) / camera.fx()});
  }
  if (views.size() < kLeastViews) return std::nullopt;
  return residualOf(views);
}

Change scaled(double x, double y, const std::string& more = {}) {
  return {{"boxes are of images of another size",
           fmt::format("multiply x1, x2 by {:.4g} and y1, y2 by {:.4g}{}", x, y, more)},
          {x, 0, 0, y}};
}

std::vector<Change> changesOfPixels(const CameraModel& camera, const Box& all) {
  const double W = camera.width(), H = camera.height();
  const std::string x = fmt::format("x1 = {:.0f} - x2, x2 = {:.0f} - x1", W, W);
  const std::string y = fmt::format("y1 = {:.0f} - y2, y2 = {:.0f} - y1", H, H);
  const char* percent = std::max(all.x2, all.y2) < 101.0 ? " (percent of the image?)" : "";
  const double s = all.x2 / W, above = all.y2 / s - H;
  constexpr double kSame = 0.02;
  const bool margin = std::abs(above) > kSame * H && std::abs(s - 1.0) > kSame;
  std::vector<Change> changes{
      {{"boxes are mirrored left to right", "write " + x}, {-1, 0, 0, 1}, {W, 0}},
      {{"boxes count y from the lower border", "write " + y}, {1, 0, 0, -1}, {0, H}},
      {{"boxes are turned by 180°", "write " + x + ", " + y}, {-1, 0, 0, -1}, {W, H}},
      {{"x and y of the boxes are exchanged", "write x in the columns of y"}, {0, 1, 1, 0}},
      {{"boxes are of images turned by 90°",
        fmt::format("write x1 = y1, x2 = y2, y1 = {0:.0f} - x2, y2 = {0:.0f} - x1", H)},
       {0, 1, -1, 0},
       {0, H}},
      {{"boxes are of images turned by 90°",
        fmt::format("write x1 = {0:.0f} - y2, x2 = {0:.0f} - y1, y1 = x1, y2 = x2", W)},
       {0, -1, 1, 0},
       {W, 0}},
      {{"boxes are shifted (crop or margin)",
        fmt::format("add {:.0f} to x1 and x2, {:.0f} to y1 and y2", W - all.x2, H - all.y2)},
       {1, 0, 0, 1},
       {W - all.x2, H - all.y2}},
      scaled(W / all.x2, H / all.y2, percent)};
  if (margin) {
    changes.push_back(
        {{"boxes are of scaled images with a margin",
          fmt::format("divide by {:.4g}, then subtract {:.0f} from y1 and y2", s, above)},
         {1 / s, 0, 0, 1 / s},
         {0, -above}});
  }
  for (const double factor :
       {0.5, 0.67, 0.75, 0.8, 0.9, 0.95, 1.05, 1.1, 1.25, 1.33, 1.5, 2.0, 3.0, 4.0}) {
    changes.push_back(scaled(factor, factor, ", roughly"));
  }
  return changes;
}

constexpr char kWrongNumbers[] = "boxes have wrong frame numbers";

/// Changes of frame numbers that do not exceed those of the drive.
std::vector<Change> changesOfNumbers(const Frames& frames) {
  std::uint64_t last = 0, last_boxes = 0;
  for (const auto& [number, frame] : frames) {
    last = number;
    if (!frame.detections.empty()) last_boxes = number;
  }
  std::vector<Change> changes;
  for (const std::uint64_t times : {2, 3, 4, 5, 10}) {
    if (times * last_boxes > last + times) break;
    const std::string fix = fmt::format(
        "the detector saw one frame in {} and counted these; multiply the numbers by {}", times,
        times);
    changes.push_back({.doubt = {kWrongNumbers, fix}, .times = static_cast<std::int64_t>(times)});
  }
  for (const std::int64_t by : {-20, -10, -5, -4, -3, -2, -1, 1, 2, 3, 4, 5, 10, 20}) {
    const std::string fix = fmt::format("{} about {} {} the numbers", by > 0 ? "add" : "subtract",
                                        std::abs(by), by > 0 ? "to" : "from");
    changes.push_back({.doubt = {kWrongNumbers, fix}, .shift = by});
  }
  changes.push_back({.doubt = {kWrongNumbers, fmt::format("the frames are in reverse order: write {} - "
                                                     "number",
                                                     last)},
                     .times = -1,
                     .shift = static_cast<std::int64_t>(last)});
  return changes;
}

/// A change that makes the boxes agree with the poses.
struct Fit {
  double residual = 0.0;  ///< median, in sizes of the boxes
  Doubt doubt;
};

/// A chain with its residual as given.
struct Given {
  const Chain* chain = nullptr;
  double residual = 0.0;
};

/// Some of the chains, those whose frames have poses.
std::vector<Given> givenOf(const std::vector<Chain>& chains, const Frames& frames,
                           const CameraModel& camera) {
  constexpr std::size_t kMost = 300;
  std::vector<Given> given;
  for (std::size_t i = 0; i < chains.size(); i += 1 + chains.size() / kMost) {
    const auto residual = residualAfter({}, chains[i], frames, camera);
    if (residual) given.push_back({&chains[i], *residual});
  }
  return given;
}

/// Returns nothing if the change does not improve most chains, and clearly.
std::optional<Fit> fitOf(const Change& change, const std::vector<Given>& chains,
                         const Frames& frames, const CameraModel& camera) {
  constexpr std::size_t kLeast = 10;
  constexpr double kClearly = 0.7;  // largest ratio of the residuals, least share of the chains
  std::vector<double> as_given, changed;
  double better = 0.0;
  for (const Given& given : chains) {
    const auto other = residualAfter(change, *given.chain, frames, camera);
    if (!other) continue;
    as_given.push_back(given.residual), changed.push_back(*other);
    better += *other < given.residual ? 1.0 : 0.0;
  }
  const auto tracks = static_cast<double>(changed.size());
  const double now = medianOf(changed), before = medianOf(as_given);
  if (changed.size() < kLeast || now > kClearly * before || better < kClearly * tracks)
    return std::nullopt;
  const std::string of_given = before < kWorst ? fmt::format("of {:.1f} %", 100.0 * before)
                                               : "of views that no point explains";
  const std::string fix = fmt::format(
      "{} tracks of boxes then move as the poses predict, with deviations of {:.1f} % of their "
      "size instead {}: {}",
      changed.size(), 100.0 * now, of_given, change.doubt.fix);
  return Fit{now, {change.doubt.what, fix}};
}

}  // namespace

std::optional<Doubt> doubtOfBoxes(const Frames& frames, const CameraCalibration& calibration) {
  constexpr double kEqual = 1.1;  // ratio of residuals that do not distinguish two changes
  const CameraModel camera(calibration);
  const Chains chains(frames);
  const auto given = givenOf(chains.whole(), frames, camera);
  std::vector<Change> changes = changesOfPixels(camera, extentOf(frames));
  std::ranges::move(changesOfNumbers(frames), std::back_inserter(changes));
  std::vector<Fit> fits;
  for (const Change& change : changes) {
    if (auto fit = fitOf(change, given, frames, camera)) fits.push_back(*std::move(fit));
  }
  if (fits.empty()) return std::nullopt;
  const Fit best = *std::ranges::min_element(fits, {}, &Fit::residual);
  Doubt doubt = best.doubt;
  for (const Fit& fit : fits) {
    const bool other = fit.doubt.what != best.doubt.what;
    if (other && fit.residual < kEqual * best.residual)
      doubt.fix += "; or, with equal evidence, " + fit.doubt.what;
  }
  return doubt;
}

}  // namespace perdure::tools
