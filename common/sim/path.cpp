#include "common/sim/path.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/check.h"
#include "common/math/so3.h"
#include "common/sim/dice.h"

namespace perdure::sim {
namespace {

constexpr double kStep = 0.25;  ///< metres between points of a path

using Points = std::vector<Eigen::Vector2d>;

/// The arc at a corner; the corner itself if the path is straight there or the radius is 0.
Points roundedCorner(const Eigen::Vector2d& before, const Corner& corner,
                     const Eigen::Vector2d& after) {
  const Eigen::Vector2d in = (corner.point - before).normalized();
  const Eigen::Vector2d out = (after - corner.point).normalized();
  const double turn = std::atan2(in.x() * out.y() - in.y() * out.x(), in.dot(out));
  if (corner.radius <= 0.0 || std::abs(turn) < 1e-6) return {corner.point};
  const double side = turn > 0 ? 1.0 : -1.0;
  const Eigen::Vector2d begin = corner.point - in * corner.radius * std::tan(std::abs(turn) / 2);
  const Eigen::Vector2d centre = begin + side * corner.radius * Eigen::Vector2d(-in.y(), in.x());
  const int count = std::max(2, static_cast<int>(std::abs(turn) * corner.radius / (0.5 * kStep)));
  Points arc;
  for (int i = 0; i <= count; ++i) {
    const double angle = turn * i / count;
    const Eigen::Vector2d spoke = begin - centre;
    arc.push_back(centre +
                  Eigen::Vector2d(std::cos(angle) * spoke.x() - std::sin(angle) * spoke.y(),
                                  std::sin(angle) * spoke.x() + std::cos(angle) * spoke.y()));
  }
  return arc;
}

Points outlineOf(const std::vector<Corner>& corners, bool closed) {
  const std::size_t n = corners.size();
  Points outline;
  for (std::size_t i = 0; i < n; ++i) {
    const bool end = !closed && (i == 0 || i + 1 == n);
    const Points part =
        end ? Points{corners[i].point}
            : roundedCorner(corners[(i + n - 1) % n].point, corners[i], corners[(i + 1) % n].point);
    outline.insert(outline.end(), part.begin(), part.end());
  }
  if (closed) outline.push_back(outline.front());
  return outline;
}

/// Points at equal distances along the outline; `step` is adjusted to divide the outline evenly.
Points resampled(const Points& outline, double& step) {
  std::vector<double> along{0.0};
  for (std::size_t i = 1; i < outline.size(); ++i) {
    along.push_back(along.back() + (outline[i] - outline[i - 1]).norm());
  }
  const auto count = static_cast<std::size_t>(std::max(1.0, std::round(along.back() / step)));
  step = along.back() / static_cast<double>(count);
  Points points;
  for (std::size_t k = 0, i = 1; k <= count; ++k) {
    const double s = std::min(step * static_cast<double>(k), along.back());
    while (i + 1 < along.size() && along[i] < s) ++i;
    const double part = (s - along[i - 1]) / std::max(along[i] - along[i - 1], 1e-12);
    points.push_back(outline[i - 1] + part * (outline[i] - outline[i - 1]));
  }
  return points;
}

/// The moving average, applied twice, so that the curvature is continuous.
template <class Value>
std::vector<Value> smoothed(std::vector<Value> values, int half, bool closed) {
  const int n = static_cast<int>(values.size());
  for (int pass = 0; pass < 2; ++pass) {
    const std::vector<Value> before = values;
    for (int i = 0; i < n; ++i) {
      // Near an open end the window shrinks, so that the end does not move.
      const int reach = closed ? half : std::min({half, i, n - 1 - i});
      Value sum = before[static_cast<std::size_t>(i)];
      for (int k = 1; k <= reach; ++k) {
        sum += before[static_cast<std::size_t>((i - k + n) % n)];
        sum += before[static_cast<std::size_t>((i + k) % n)];
      }
      values[static_cast<std::size_t>(i)] = sum / (2.0 * reach + 1.0);
    }
  }
  return values;
}

std::vector<PathPoint> withHeadings(const Points& points, bool closed, double step) {
  const std::size_t n = points.size();
  std::vector<PathPoint> path(n);
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector2d& before = points[i > 0 ? i - 1 : (closed ? n - 1 : 0)];
    const Eigen::Vector2d& after = points[i + 1 < n ? i + 1 : (closed ? 0 : n - 1)];
    const Eigen::Vector2d way = after - before;
    path[i].position = points[i];
    path[i].heading = std::atan2(way.y(), way.x());
    if (i > 0) {
      path[i].heading = path[i - 1].heading + wrapAngle(path[i].heading - path[i - 1].heading);
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    const double before = path[i > 0 ? i - 1 : (closed ? n - 1 : 0)].heading;
    const double after = path[i + 1 < n ? i + 1 : (closed ? 0 : n - 1)].heading;
    path[i].curvature = wrapAngle(after - before) / (2.0 * step);
  }
  return path;
}

}  // namespace

GroundPath::GroundPath(const std::vector<Corner>& corners, bool closed, double smoothing_m)
    : closed_(closed), step_(kStep) {
  check(corners.size() >= (closed ? 3u : 2u), "a path has enough corners");
  Points points = resampled(outlineOf(corners, closed), step_);
  if (closed) points.pop_back();  // equal to the first point
  points = smoothed(std::move(points), static_cast<int>(0.5 * smoothing_m / kStep), closed);
  // Smoothing shortens the curve, so that it must be resampled at equal distances.
  if (closed) points.push_back(points.front());
  points = resampled(points, step_ = kStep);
  if (closed) points.pop_back();
  points_ = withHeadings(points, closed, step_);
}

PathPoint GroundPath::at(double distance) const {
  const double total = length();
  double laps = 0.0;
  if (closed_) {
    laps = std::floor(distance / total);
    distance -= laps * total;
  }
  const double beyond = closed_ ? 0.0 : distance - std::clamp(distance, 0.0, total);
  const double u = std::clamp(distance - beyond, 0.0, total) / step_;
  const auto i = std::min(static_cast<std::size_t>(u), segments() - 1);
  const std::size_t j = (i + 1) % points_.size();
  const double s = u - static_cast<double>(i);
  const PathPoint &a = points_[i], &b = points_[j];
  PathPoint p;
  const double turn = wrapAngle(b.heading - a.heading);
  const double once_round = closed_ ? points_.back().heading +
                                          wrapAngle(points_[0].heading - points_.back().heading) -
                                          points_[0].heading
                                    : 0.0;
  p.heading = a.heading + s * turn + laps * once_round;
  p.curvature = beyond != 0.0 ? 0.0 : a.curvature + s * (b.curvature - a.curvature);
  p.position = a.position + s * (b.position - a.position) +
               beyond * Eigen::Vector2d(std::cos(p.heading), std::sin(p.heading));
  return p;
}

double Drive::distanceAt(double t_s) const {
  const double last = static_cast<double>(distance.size() - 1);
  const double u = std::clamp((t_s - start_s) / interval_s, 0.0, last);
  const auto i = static_cast<std::size_t>(std::min(std::floor(u), std::max(0.0, last - 1)));
  const std::size_t j = std::min(i + 1, distance.size() - 1);
  return distance[i] + (u - static_cast<double>(i)) * (distance[j] - distance[i]);
}

namespace {

/// The highest speeds within all limits, at every step of the path from `from` on.
std::vector<double> speedProfile(const GroundPath& path, const SpeedLimits& limits, double from,
                                 double length, bool stops) {
  const auto count = static_cast<std::size_t>(std::ceil(length / kStep)) + 1;
  std::vector<double> speed(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double curvature = std::abs(path.at(from + kStep * static_cast<double>(i)).curvature);
    speed[i] = std::min(limits.top, std::sqrt(limits.lateral / std::max(curvature, 1e-6)));
  }
  speed.front() = 0.0;
  if (stops) speed.back() = 0.0;
  for (std::size_t i = 1; i < count; ++i) {
    const double reached = std::sqrt(speed[i - 1] * speed[i - 1] + 2.0 * limits.accelerate * kStep);
    speed[i] = std::min(speed[i], reached);
  }
  for (std::size_t i = count - 1; i-- > 0;) {
    const double allowed = std::sqrt(speed[i + 1] * speed[i + 1] + 2.0 * limits.brake * kStep);
    speed[i] = std::min(speed[i], allowed);
  }
  return speed;
}

}  // namespace

Drive drive(const GroundPath& path, const SpeedLimits& limits, double from, double to,
            double rest_s, double until_s) {
  const bool stops = std::isfinite(to);
  const double length = stops ? to - from : limits.top * until_s + kStep;
  const std::vector<double> speed = speedProfile(path, limits, from, length, stops);
  Drive result;
  double t = rest_s;
  std::size_t i = 0;  // index in the speed profile
  const auto count = static_cast<std::size_t>(std::ceil(until_s / result.interval_s)) + 1;
  while (result.distance.size() < count) {
    const double now = result.interval_s * static_cast<double>(result.distance.size());
    double duration = 0.0;
    while (i + 1 < speed.size()) {
      duration = 2.0 * kStep / (speed[i] + speed[i + 1]);
      if (t + duration > now) break;
      t += duration;
      ++i;
    }
    double s = kStep * static_cast<double>(i);
    if (i + 1 < speed.size() && now > t) {
      const double accel = (speed[i + 1] - speed[i]) / duration;
      s += speed[i] * (now - t) + 0.5 * accel * (now - t) * (now - t);
    }
    result.distance.push_back(from + s);
  }
  // A driver needs about half a second to change the acceleration.
  result.distance = smoothed(std::move(result.distance), 4, false);
  return result;
}

Drive cruise(double from, double speed, double from_s, double until_s) {
  Drive result;
  result.start_s = from_s;
  const auto count = static_cast<std::size_t>(std::ceil((until_s - from_s) / result.interval_s));
  for (std::size_t i = 0; i <= count; ++i) {
    result.distance.push_back(from + speed * result.interval_s * static_cast<double>(i));
  }
  return result;
}

namespace {

/// Unevenness of the road as waves with lengths of 3 to 9 m.
class Roughness {
 public:
  Roughness(std::uint64_t seed, double lap_m) {
    Dice dice(seed);
    for (Wave& wave : waves_) {
      wave = {dice.uniform(3.0, 9.0), dice.uniform(0.0, 2.0 * M_PI)};
      if (lap_m > 0.0) wave.length = lap_m / std::round(lap_m / wave.length);
    }
  }
  /// Three independent heights between -1 and 1, for bounce, roll and pitch.
  Eigen::Vector3d at(double distance) const {
    Eigen::Vector3d height = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < waves_.size(); ++i) {
      height[static_cast<Eigen::Index>(i % 3)] +=
          std::sin(2.0 * M_PI * distance / waves_[i].length + waves_[i].phase) / 3.0;
    }
    return height;
  }

 private:
  struct Wave {
    double length = 1.0, phase = 0.0;
  };
  std::array<Wave, 9> waves_;
};

}  // namespace

Trajectory vehicleMotion(const GroundPath& path, const Drive& drive, const Suspension& suspension) {
  const Roughness roughness(seedOf("roughness", {suspension.seed}), suspension.lap_m);
  const std::vector<double>& s = drive.distance;
  std::vector<RigidTransform> controls;
  for (std::size_t i = 0; i < s.size(); ++i) {
    const double before = s[i > 0 ? i - 1 : 0], after = s[std::min(i + 1, s.size() - 1)];
    const double speed = (after - before) / (2.0 * drive.interval_s);
    const double accel = (after - 2.0 * s[i] + before) / (drive.interval_s * drive.interval_s);
    const PathPoint p = path.at(s[i]);
    const Eigen::Vector3d rough = roughness.at(s[i]);
    const double roll =
        suspension.roll_per_accel * speed * speed * p.curvature + suspension.sway_rad * rough.y();
    const double pitch = -suspension.pitch_per_accel * accel + suspension.sway_rad * rough.z();
    const Eigen::Quaterniond q = expQuaternion({0, 0, p.heading}) * expQuaternion({0, pitch, 0}) *
                                 expQuaternion({roll, 0, 0});
    controls.emplace_back(q, Eigen::Vector3d(p.position.x(), p.position.y(),
                                             suspension.height + suspension.bounce_m * rough.x()));
  }
  return Trajectory(drive.start_s, drive.interval_s, std::move(controls));
}

Trajectory uprightMotion(const GroundPath& path, const Drive& drive, double height) {
  std::vector<RigidTransform> controls;
  for (const double s : drive.distance) {
    const PathPoint p = path.at(s);
    controls.emplace_back(expQuaternion({0, 0, p.heading}),
                          Eigen::Vector3d(p.position.x(), p.position.y(), height));
  }
  return Trajectory(drive.start_s, drive.interval_s, std::move(controls));
}

}  // namespace perdure::sim
