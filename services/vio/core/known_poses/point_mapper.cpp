#include "services/vio/core/known_poses/point_mapper.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace perdure::vio {
namespace {

std::int64_t viewsOf(const Track& track) { return static_cast<std::int64_t>(track.views()); }

constexpr std::size_t kViews = 24;   // largest number of stored poses
constexpr std::size_t kRecent = 12;  // number of newest poses, which stay stored
constexpr double kForget = 0.05;     // weight of a new image in the scale
constexpr double kMany = 10.0;       // points for the full weight; fewer reduce it
constexpr double kMoved = 0.05;      // m; the body rests if it moves less than this,
constexpr double kTurned = 0.05;     // rad; and turns less than this
constexpr double kGate = 3.0;        // largest ratio of a point's residuals to scale_

double lackOfFit(const Triangulated& point, std::size_t rays) {
  // rms² is the mean of 2n squares, which have 2n − 3 degrees of freedom after the fit of the
  // point.
  const auto n = static_cast<double>(rays);
  return point.rms * point.rms * 2.0 * n / (2.0 * n - 3.0);
}

}  // namespace

PointMapper::PointMapper(const VisionOptions& options, const WindowOptions& window,
                         std::vector<RigidTransform> T_BC, std::vector<double> readout_s)
    : options_(options), window_(window), T_BC_(std::move(T_BC)), readout_s_(std::move(readout_s)) {
  readout_s_.resize(T_BC_.size(), 0.0);
}

void PointMapper::clear() {
  views_.clear();
  database_.clear();
  landmarks_.clear();
  mapped_ = {};
}

/// Removes tracks that have ended, and poses older than the first view of every remaining track.
void PointMapper::forgetEnded() {
  database_.eraseIf([&](const Track& track) { return !track.seenAt(frame_); });
  std::uint64_t oldest = frame_;
  for (const auto& [id, track] : database_.tracks()) {
    oldest = std::min(oldest, track.observations.front().frame);
  }
  std::erase_if(views_, [&](const View& view) { return view.frame < oldest; });
}

/// Removes the pose that adds the least baseline. The newest poses are not removed, because most
/// tracks are short.
void PointMapper::forgetOne() {
  std::size_t least = 1;
  double shortest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i + kRecent < views_.size(); ++i) {
    const double way = (views_[i + 1].pose.T_WB.p - views_[i - 1].pose.T_WB.p).norm();
    if (way < shortest) shortest = way, least = i;
  }
  database_.removeFrame(views_[least].frame);
  views_.erase(views_.begin() + static_cast<long>(least));
}

RigidTransform PointMapper::cameraOf(const View& view, std::size_t camera, double row) const {
  const double s = row * readout_s_[camera];
  if (s == 0.0) return view.pose.T_WB * T_BC_[camera];
  RowMotion motion;
  motion.rate = view.pose.rate_B;
  motion.velocity = view.pose.T_WB.q.conjugate() * view.pose.velocity_W;
  return view.pose.T_WB * rowCamera(motion, T_BC_[camera], s).T_BC;
}

std::vector<Ray> PointMapper::raysOf(const Track& track) const {
  std::vector<Ray> rays;
  rays.reserve(track.views());
  auto view = views_.begin();
  for (const Observation& o : track.observations) {
    while (view != views_.end() && view->frame < o.frame) ++view;
    if (view == views_.end() || view->frame != o.frame) continue;
    for (std::size_t c = 0; c < T_BC_.size(); ++c) {
      if (!o.seen[c]) continue;
      rays.push_back({cameraOf(*view, c, o.seen[c]->row), o.seen[c]->normalised,
                      o.seen[c]->scale / options_.sigma_px});
    }
  }
  return rays;
}

/// Returns true if the point fits and its depth is known well. Triangulation and scale also use
/// other points, because otherwise a scale that bad poses raised could not fall again.
bool PointMapper::isSure(const Triangulated& point) const {
  return point.rms <= kGate * scale_ && point.relative_sigma * scale_ < options_.max_relative_sigma;
}

void PointMapper::note(const Reason& why) {
  if (why.code == "triangulation_depth") ++mapped_.contradicted;
  if (why.code == "triangulation_far") ++mapped_.far;
}

bool PointMapper::moved() const {
  if (views_.size() < 2) return false;
  const RigidTransform &before = views_.front().pose.T_WB, &now = views_.back().pose.T_WB;
  return (now.p - before.p).norm() > kMoved || now.q.angularDistance(before.q) > kTurned;
}

void PointMapper::learnScale(const std::vector<Candidate>& candidates) {
  if (candidates.empty()) return;
  std::vector<double> fits;
  for (const Candidate& c : candidates) fits.push_back(c.point.rms);
  const auto middle = fits.begin() + static_cast<long>(fits.size() / 2);
  std::nth_element(fits.begin(), middle, fits.end());
  const double weight = std::min(1.0, static_cast<double>(fits.size()) / kMany);
  scale_ = std::max(1.0, scale_ + weight * kForget * (*middle - scale_));
}

void PointMapper::add(const KnownPose& pose, const TrackedFrame& tracked) {
  ++frame_;
  views_.push_back({frame_, pose});
  database_.add(frame_, tracked);
  forgetEnded();
  if (views_.size() > kViews) forgetOne();
  std::vector<Candidate> candidates;
  mapped_ = {};
  for (const TrackedPoint& seen : tracked.points) {
    const Track* track = database_.find(seen.id);
    if (!track || viewsOf(*track) < window_.min_observations) continue;
    const auto rays = raysOf(*track);
    auto point = triangulate(rays, options_);
    if (!point) {
      note(point.error());
      continue;
    }
    point->rms = std::sqrt(lackOfFit(*point, rays.size()));
    candidates.push_back({&seen, *point});
  }
  landmarks_.clear();
  for (const Candidate& c : candidates) {
    if (!isSure(c.point)) continue;
    Landmark l;
    l.id = c.seen->id;
    l.p_W = c.point.p_W;
    l.covariance = scale_ * scale_ * c.point.covariance;
    l.cross_pose = crossOfRigid(l.p_W, pose.T_WB, pose.covariance);
    l.pixel = c.seen->seen[0]->pixel;
    landmarks_.push_back(l);
  }
  mapped_.sure = landmarks_.size();
  learnScale(candidates);
}

constexpr double kForgets = 1.0 / 40;  // weight of each new image
constexpr std::size_t kFewest = 40;    // number of images before the first verdict
constexpr double kTracks = 2.0;        // mean tracks per image that a verdict needs
constexpr double kMisfit = 15.0;       // limit of the scale; inaccurate poses reach up to 8
constexpr double kFewTracks = 0.5;     // mean tracks needed if nearly all contradict
constexpr double kNearlyAll = 10.0;    // ratio of contradicting to agreeing tracks

void Agreement::add(const Mapped& mapped, double scale, bool moved) {
  if (!moved) return;
  ++images_;
  scale_ = scale;
  contradicted_ += kForgets * (static_cast<double>(mapped.contradicted) - contradicted_);
  far_ += kForgets * (static_cast<double>(mapped.far) - far_);
  sure_ += kForgets * (static_cast<double>(mapped.sure) - sure_);
}

Agreement::Verdict Agreement::verdict() const {
  if (images_ < kFewest) return Verdict::kGood;
  const bool misfit = sure_ > kTracks && scale_ > kMisfit;
  if (misfit || contradicted_ > std::max(sure_, kTracks) ||
      contradicted_ > std::max(kNearlyAll * sure_, kFewTracks)) {
    return Verdict::kContradicted;
  }
  return far_ > std::max(kNearlyAll * sure_, kTracks) ? Verdict::kFar : Verdict::kGood;
}

}  // namespace perdure::vio
