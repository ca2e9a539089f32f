#include "common/replay/files/pose_file.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "common/base/check.h"
#include "common/base/errors.h"
#include "common/math/so3.h"
#include "common/replay/files/pose_columns.h"
#include "common/replay/files/pose_steps.h"
#include "common/replay/files/stamps.h"
#include "common/replay/files/text_file.h"

namespace perdure::replay {
namespace {

constexpr double kUnitTolerance = 1e-2;

/// Returns whether the names of eight columns put w of the quaternion first (q_w, qx [], q_RS_y …).
bool namesWFirst(const std::vector<std::string_view>& names) {
  constexpr std::string_view kOrder = "wxyz";
  if (names.size() != 8) return false;
  for (std::size_t i = 0; i < kOrder.size(); ++i) {
    const std::string name = toLower(trim(names[4 + i].substr(0, names[4 + i].find('['))));
    if (!name.ends_with(kOrder[i])) return false;
  }
  return true;
}

/// Returns whether the fields are a header. Its first name may be empty, because pandas writes a
/// row number before each line.
bool isHeaderOfPoses(std::vector<std::string_view> fields) {
  if (fields.size() > 2 && fields.front().empty()) fields.erase(fields.begin());
  return isHeader(fields);
}

void addTum(const TextLine& line, const std::vector<std::string_view>& fields, bool w_first,
            bool nanoseconds, std::vector<StampedPose>& poses, Complaints& wrong) {
  auto time = parseSeconds(fields[0]);
  if (nanoseconds && fields[0].find('.') == fields[0].npos) time = parseNanoseconds(fields[0]);
  const auto v = parseNumbers(fields);
  if (v && !time) {
    return wrong.add(line.number, "the time " + std::string(fields[0]) +
                                      " is not in seconds; where it is in nanoseconds, divide it "
                                      "by 1000000000");
  }
  if (!v) {
    return wrong.add(line.number,
                     "write eight finite numbers, t x y z qx qy qz qw, with decimal points; leave "
                     "out a line whose pose is not known");
  }
  const std::size_t x = w_first ? 5 : 4, w = w_first ? 4 : 7;
  const Eigen::Quaterniond q((*v)[w], (*v)[x], (*v)[x + 1], (*v)[x + 2]);
  if (std::abs(q.norm() - 1.0) > kUnitTolerance) {
    return wrong.add(line.number, "the quaternion's norm is " + std::to_string(q.norm()) +
                                      ", not 1; the order is qx qy qz qw");
  }
  if (!poses.empty() && *time == poses.back().time) {
    return wrong.add(line.number, "the time is that of the line before; leave one of them out");
  }
  if (!poses.empty() && *time < poses.back().time) {
    return wrong.add(line.number, "the time does not increase; sort the lines by time");
  }
  poses.push_back({*time, RigidTransform(q, {(*v)[1], (*v)[2], (*v)[3]})});
}

void addKitti(const TextLine& line, const std::vector<std::string_view>& fields,
              std::vector<StampedPose>& poses, Complaints& wrong) {
  const auto v = parseNumbers(fields);
  if (!v) {
    return wrong.add(line.number,
                     "write 12 or 16 finite numbers, row by row, with decimal points; where a "
                     "frame's pose is not known, give lines t x y z qx qy qz qw of the others");
  }
  using RowMajor = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
  const RowMajor T = Eigen::Map<const RowMajor>(v->data());
  const Eigen::Matrix3d R = T.leftCols<3>();
  if (!isRotation(R)) {
    return wrong.add(line.number, "the rotation is not orthonormal and right-handed");
  }
  if (v->size() == 16 && ((*v)[12] != 0 || (*v)[13] != 0 || (*v)[14] != 0 || (*v)[15] != 1)) {
    return wrong.add(line.number, "the last row of a 4x4 pose is 0 0 0 1");
  }
  poses.push_back({TimePoint{}, RigidTransform(R, T.col(3))});
}

}  // namespace

PoseFile::PoseFile(PoseFormat format, std::vector<StampedPose> poses, std::vector<Matrix6d> steps)
    : format_(format), poses_(std::move(poses)), steps_(std::move(steps)) {
  check(steps_.empty() || steps_.size() == poses_.size(), "each pose has a step, or none has");
}

PoseFile PoseFile::read(const std::filesystem::path& file, std::string_view fix) {
  const auto lines = readLines(file, fix);
  Complaints wrong(file);
  std::vector<StampedPose> poses;
  PoseSteps steps;
  std::size_t columns = 0, last_line = 0, angles = 0;
  bool w_first = false, headed = false;
  std::optional<PoseColumns> named;
  for (const auto& line : lines) {
    const std::size_t expected = std::exchange(last_line, line.number) + 1;
    // In a line without a time, the line number is the frame number.
    if (columns > 8 && !named && line.number != expected && !poses.empty()) {
      wrong.add(expected,
                "the line is empty, and poses are counted by lines; write the frame's pose");
    }
    const bool comment = line.text.starts_with('#');
    auto fields = fieldsOf(std::string_view(line.text).substr(comment ? 1 : 0));
    if (!steps.take(line, comment, !poses.empty(), fields, wrong)) continue;
    if (columns == 0) {
      if (const auto other = otherKindOfPoses(line.text, fields); !other.empty()) {
        wrong.add(line.number, other);
        break;
      }
    }
    if (comment || (columns == 0 && !headed && isHeaderOfPoses(fields))) {
      headed = headed || !comment;
      w_first = w_first || (columns == 0 && namesWFirst(fields));
      if (columns != 0) continue;
      if (const auto these = poseColumnsOf(fields)) named = these;
      if (namesAngles(fields)) angles = fields.size();
      continue;
    }
    if (columns == 0) {
      columns = fields.size();
      if (named && named->count != columns) named.reset();
      if (angles == columns) {
        wrong.add(line.number,
                  "the header names angles (roll, pitch, yaw); write the orientations as "
                  "quaternions, t x y z qx qy qz qw");
        break;
      }
    }
    const bool known = columns == 8 || columns == 12 || columns == 16;
    if (named && fields.size() == columns) {
      std::vector<std::string_view> ordered;
      for (const std::size_t column : named->of) ordered.push_back(fields[column]);
      addTum(line, ordered, false, named->nanoseconds, poses, wrong);
    } else if (!known || fields.size() != columns) {
      wrong.add(line.number, std::to_string(fields.size()) +
                                 " numbers; write 8 (TUM: t x y z qx qy qz qw) or 12 or 16 (KITTI: "
                                 "a row-major pose) in every line, and name columns for "
                                 "the covariance of each step (step_x_x …) in a header");
    } else if (columns == 8) {
      addTum(line, fields, w_first, false, poses, wrong);
    } else {
      addKitti(line, fields, poses, wrong);
    }
  }
  wrong.throwIfAny();
  if (poses.empty()) {
    throw StartupError(ExitCode::kData, file.string() + ": holds no poses");
  }
  return PoseFile(columns == 8 || named ? PoseFormat::kTum : PoseFormat::kKitti, std::move(poses),
                  std::move(steps.covariances));
}

std::optional<RigidTransform> PoseFile::at(std::uint64_t frame, TimePoint time,
                                           Duration max_gap) const {
  const auto place = placeOf(frame, time, max_gap);
  if (!place) return std::nullopt;
  const RigidTransform& before = poses_[place->index].T_WB;
  if (place->share == 0.0) return before;
  return interpolate(before, poses_[place->index + 1].T_WB, place->share);
}

std::optional<PoseFile::Place> PoseFile::placeOf(std::uint64_t frame, TimePoint time,
                                                 Duration max_gap) const {
  if (format_ == PoseFormat::kTum) return placeAtTime(time, max_gap);
  if (frame >= poses_.size()) return std::nullopt;
  return Place{frame};
}

std::optional<PoseFile::Place> PoseFile::placeAtTime(TimePoint time, Duration max_gap) const {
  constexpr Duration kSame = std::chrono::milliseconds(1);
  const auto after = std::lower_bound(poses_.begin(), poses_.end(), time,
                                      [](const StampedPose& p, TimePoint t) { return p.time < t; });
  const auto index = static_cast<std::size_t>(after - poses_.begin());
  if (after != poses_.end() && between(after->time, time) <= kSame) return Place{index};
  if (after == poses_.begin()) return std::nullopt;
  const auto before = after - 1;
  if (between(time, before->time) <= kSame) return Place{index - 1};
  if (after == poses_.end() || between(after->time, before->time) > max_gap) return std::nullopt;
  const double s =
      toSeconds(between(time, before->time)) / toSeconds(between(after->time, before->time));
  return Place{index - 1, s};
}

/// The rotation error of step k moves the body at `now` by the lever from pose k to it. A step that
/// lies only partly between the frames contributes its share.
Matrix6d PoseFile::errorOfSteps(const FrameStamp& before, const FrameStamp& now) const {
  const auto a = placeOf(before.sequence, before.time), b = placeOf(now.sequence, now.time);
  check(!steps_.empty() && a && b, "both frames have a pose, and the file has steps");
  const RigidTransform T_WB = *at(now.sequence, now.time);
  const double from = static_cast<double>(a->index) + a->share;
  const double to = static_cast<double>(b->index) + b->share;
  Matrix6d error = Matrix6d::Zero();
  for (std::size_t k = a->index + 1; k <= b->index + (b->share > 0.0 ? 1 : 0); ++k) {
    const double end = static_cast<double>(k);
    const RigidTransform& T_WK = poses_[k].T_WB;
    Matrix6d J = Matrix6d::Zero();
    J.topLeftCorner<3, 3>() = T_WB.R().transpose() * T_WK.R();
    J.bottomLeftCorner<3, 3>() = -skew(T_WB.p - T_WK.p) * T_WK.R();
    J.bottomRightCorner<3, 3>() = T_WK.R();
    error += (std::min(end, to) - std::max(end - 1.0, from)) * J * steps_[k] * J.transpose();
  }
  return error;
}

}  // namespace perdure::replay
