#include "tools/calibrate/rig_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "common/base/algorithms/median.h"
#include "common/base/errors.h"
#include "common/math/chi2.h"
#include "common/math/so3.h"
#include "common/replay/read_ahead.h"
#include "services/vio/core/state/saved_state.h"
#include "services/vio/node.h"

namespace perdure::calibrate {
namespace {

constexpr double kDegrees = 180.0 / M_PI;
constexpr std::size_t kFewest = 500;  // least number of innovations for a judgement

/// Runs vio over the drive in one thread.
class Watched {
 public:
  Watched(const RigCheckOptions& options, const replay::Dataset& dataset)
      : watch_(dataset.calibration().cameras[0], options.seconds) {
    vio::Outputs outputs;
    outputs.odometry = [this](const Odometry& odometry) { watch_.onOdometry(odometry); };
    outputs.innovations = [this](const std::vector<vio::Innovation>& all) {
      watch_.onInnovations(all);
    };
    node_ = std::make_unique<vio::Node>(options.vio, 1, std::move(outputs));
    node_->setWorld({1, 0});
    node_->onCalibration(dataset.calibration());
    cameras_ = dataset.calibration().cameras.size();
  }

  void run(replay::Dataset& dataset, const RigCheckOptions& options) {
    constexpr std::size_t kEvery = 10;  // interval of the checks, in images
    std::optional<TimePoint> first;
    std::size_t images = 0;
    replay::ReadAhead ahead(dataset);
    while (!options.stop.stop_requested()) {
      const auto message = ahead.next();
      if (!message) break;
      if (const auto* imu = std::get_if<ImuSample>(&*message)) node_->onImu(*imu), ++samples_;
      if (const auto* speed = std::get_if<SpeedSample>(&*message)) node_->onSpeed(*speed);
      const auto* frame = std::get_if<Frame>(&*message);
      if (!frame || !frame->data) continue;
      if (!first) first = frame->stamp.time;
      if (toSeconds(frame->stamp.time - *first) > options.seconds) break;
      node_->onFrame(*frame);
      watch_.remember(*node_);
      if (options.until_sure && ++images % kEvery == 0 && isSurelyGood(check())) break;
    }
    node_->flush();
    watch_.remember(*node_);
  }
  std::size_t samples() const { return samples_; }
  RigCheck check() const {
    RigCheck check = watch_.check(node_->reasons());
    check.cameras = cameras_;
    return check;
  }

 private:
  RigWatch watch_;
  std::size_t cameras_ = 1;
  std::unique_ptr<vio::Node> node_;
  std::size_t samples_ = 0;
};

/// Converts accepted innovations to corner residuals over the image.
std::vector<CornerResidual> residualsOf(const std::vector<vio::Innovation>& innovations) {
  std::vector<CornerResidual> all;
  for (const auto& i : innovations) {
    if (i.used) all.push_back({0, 0.0, i.pixel, i.residual});
  }
  return all;
}

/// RMS in px of the residual pattern that both halves of the drive share; 0 if not significant. A
/// pattern in one half may come from a single track, whose residuals are correlated.
double patternOf(const CameraCalibration& camera, const std::vector<CornerResidual>& residuals) {
  constexpr std::size_t kEnough = 20;  // least number of corners in each half
  constexpr double kSure = 3.0;        // least significance in standard deviations
  const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
  const auto before = cellsOf(camera, {residuals.begin(), middle});
  const auto after = cellsOf(camera, {middle, residuals.end()});
  double sum = 0.0, squares = 0.0, cells = 0.0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (before[i].corners < kEnough || after[i].corners < kEnough) continue;
    const double common = before[i].mean.dot(after[i].mean);
    sum += common, squares += common * common, cells += 1.0;
  }
  if (cells < 2.0) return 0.0;
  const double mean = sum / cells;
  const double sigma = std::sqrt(std::max(0.0, squares / cells - mean * mean) / (cells - 1.0));
  return mean > kSure * sigma ? std::sqrt(mean) : 0.0;
}

/// Limits of deviations of a camera's pose and time offset: good up to `good`, bad above `bad`.
struct Bars {
  double good, bad;
};
constexpr Bars kTurned{0.4 / kDegrees, 1.0 / kDegrees}, kShifted_m{0.015, 0.04},
    kLater_s{2e-3, 8e-3};

/// Judges a quantity by vio's deviation from the rig, compared with vio's standard deviation.
Judgement judgeMove(const char* what, double moved, double sigma, const Bars& bars,
                    const std::string& shown, const std::string& remedy) {
  // Ignores a deviation if vio is uncertain of it, or if the true value may be within the good
  // range.
  const bool sure = moved > 3.0 * sigma && moved - sigma > bars.good;
  return judged(sure ? gradeOf(moved, bars.good, bars.bad) : Grade::kGood,
                fmt::format("vio sees the {} {} off the rig", what, shown), remedy);
}

constexpr char kNoRemedy[] = "correct nothing before the causes above are excluded";

/// Judges the camera's pose and time offset. `sole`: no other cause explains a deviation.
Judgements judgePlaceOf(const RigCheck& check, bool lens_fits, bool sole) {
  Judgements all;
  const char* again =
      !sole       ? kNoRemedy
      : lens_fits ? "calibrate again (perdure calibrate), or see whether the camera has moved"
                  : "the lens, which does not fit either, may be why: calibrate both (perdure "
                    "calibrate)";
  const double turned = check.turned.norm(), shifted = check.shifted.norm();
  all.push_back(judgeMove(
      "camera's rotation", turned, check.sigma.head<3>().norm(), kTurned,
      fmt::format("{:.2f}° (± {:.2f})", kDegrees * turned, kDegrees * check.sigma.head<3>().norm()),
      again));
  all.push_back(judgeMove(
      "camera's position", shifted, check.sigma.segment<3>(3).norm(), kShifted_m,
      fmt::format("{:.1f} mm (± {:.1f})", 1e3 * shifted, 1e3 * check.sigma.segment<3>(3).norm()),
      again));
  all.push_back(
      judgeMove("time offset", std::abs(check.later_s), check.sigma[6], kLater_s,
                fmt::format("{:.2f} ms (± {:.2f})", 1e3 * check.later_s, 1e3 * check.sigma[6]),
                sole ? fmt::format("set time_offset_s to {:.4f}, or calibrate again",
                                   check.camera.time_offset_s + check.later_s)
                     : kNoRemedy));
  return all;
}

Judgement judgeGravity(const RigCheck& check) {
  return judged(std::max(gradeOf(check.accel_bias.norm(), 0.5, 1.5),
                         gradeOf(check.accel_bias_change, 0.2, 0.6)),
                fmt::format("accelerometer bias {:.3f} m/s², changed by {:.3f} in the second half",
                            check.accel_bias.norm(), check.accel_bias_change),
                "gravity is not explained: the camera's rotation on the IMU, `gravity` in "
                "vio.yaml or the IMU's scale is wrong");
}

double againstOf(const RigCheck& check) {
  return static_cast<double>(check.contradicted) /
         static_cast<double>(std::max<std::size_t>(1, check.frames));
}

constexpr double kFewAgainst = 0.05, kManyAgainst = 0.2;
constexpr std::size_t kFewEven = 4;
constexpr char kEvenStart[] =
    "it begins in even motion, by which an IMU shows neither speed nor tilt: begin at rest or in a "
    "turn, or record a speed; otherwise ";

/// Reports several deviations as one if they have one cause, because their values have no meaning
/// then.
void judgeAllAtOnce(const Judgements& place, const Judgement& gravity, Judgements& all) {
  const auto isOff = [](const Judgement& one) { return one.grade != Grade::kGood; };
  const auto off = std::ranges::count_if(place, isOff) + (isOff(gravity) ? 1 : 0);
  all.push_back({off > 2 ? Grade::kBad : Grade::kDoubtful,
                 "the camera's place, its time and gravity are not explained together, which one "
                 "cause does: the order, signs and units of the IMU's columns, T_BS by many "
                 "degrees, or the focal length; exclude these first"});
}

}  // namespace

RigWatch::RigWatch(const CameraCalibration& camera, double seconds)
    : seconds_(durationFromSeconds(seconds)) {
  check_.camera = camera;
}

void RigWatch::onOdometry(const Odometry& odometry) {
  if (!last_) until_ = odometry.stamp.time + seconds_;
  last_ = odometry.stamp.time;
  if (late()) return;
  ++check_.frames;
  if (odometry.state == OdometryState::kInitialising) return;
  ++check_.tracked;
  gyro_.push_back(odometry.gyro_bias);
  accel_.push_back(odometry.accel_bias);
}

void RigWatch::onInnovations(const std::vector<vio::Innovation>& innovations) {
  if (late()) return;
  check_.innovations.insert(check_.innovations.end(), innovations.begin(), innovations.end());
}

void RigWatch::remember(const vio::Node& node) {
  if (!late() && node.started()) saved_ = node.saveState();
}

RigCheck RigWatch::check(const ReasonCounts& of_vio) const {
  RigCheck check = check_;
  check.resets = of_vio.of("reset");
  check.holes = of_vio.of("clock_jumped_or_blackout") + of_vio.of("imu_gap_too_long") +
                of_vio.of("clock_jumped_back");
  check.speed_refused = of_vio.of("speed_gated");
  check.even = of_vio.of("start_picture_moves_imu_does_not");
  check.contradicted = of_vio.of("images_contradict_imu");
  const auto saved = vio::fromText(saved_);
  if (!saved || gyro_.empty()) return check;
  check.believed = true;
  const RigidTransform& T_BC = saved->T_BC[0];
  check.turned = logSo3(Eigen::Quaterniond(check.camera.T_BC.q.conjugate() * T_BC.q));
  check.shifted = T_BC.p - check.camera.T_BC.p;
  check.later_s = saved->time_offset_s - check.camera.time_offset_s;
  const auto variances = saved->covariance.diagonal().eval();
  check.sigma << variances.segment<6>(vio::kNavSize).cwiseSqrt(),
      std::sqrt(variances[variances.size() - 1]);
  check.gyro_bias = gyro_.back(), check.accel_bias = accel_.back();
  check.gyro_bias_change = (gyro_.back() - gyro_[gyro_.size() / 2]).norm();
  check.accel_bias_change = (accel_.back() - accel_[accel_.size() / 2]).norm();
  return check;
}

bool isSurelyGood(const RigCheck& check) {
  constexpr double kQuarter = 0.25;  // a bad value then deviates by four sigma at least
  const bool sure = check.believed && check.sigma.head<3>().norm() < kQuarter * kTurned.bad &&
                    check.sigma.segment<3>(3).norm() < kQuarter * kShifted_m.bad &&
                    check.sigma[6] < kQuarter * kLater_s.bad;
  return sure && worstOf(judgeRig(check)) == Grade::kGood;
}

double innovationRatio(const std::vector<vio::Innovation>& innovations) {
  std::vector<double> values;
  for (const auto& i : innovations) values.push_back(i.nis / chi2Quantile(0.5, i.rows));
  return medianOf(std::move(values));
}

replay::Recording thinned(replay::Recording recording) {
  constexpr double kMost_rad = 0.05;
  constexpr Duration kMost = std::chrono::milliseconds(110), kShort = std::chrono::seconds(30);
  const auto& frames = recording.frames;
  if (frames.empty() || frames.back().time - frames.front().time < kShort) return recording;
  std::set<std::uint64_t> kept;
  std::optional<TimePoint> last;
  double turned = 0.0;
  auto sample = recording.imu.begin();
  std::optional<TimePoint> next;  // stamp of the next image
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const auto& frame = frames[i];
    for (; sample != recording.imu.end() && sample->time < frame.time; ++sample) {
      if (sample == recording.imu.begin()) continue;
      turned += sample->gyro.norm() * toSeconds(sample->time - std::prev(sample)->time);
    }
    if (frame.camera != 0) continue;
    next.reset();
    for (std::size_t k = i + 1; k < frames.size() && !next; ++k) {
      if (frames[k].camera == 0) next = frames[k].time;
    }
    if (last && next && *next - *last < kMost && turned < kMost_rad) continue;
    kept.insert(frame.index);
    last = frame.time, turned = 0.0;
  }
  const auto all = static_cast<double>(recording.frames.size());
  std::erase_if(recording.frames, [&](const auto& frame) { return !kept.contains(frame.index); });
  recording.frame_count = kept.size();
  for (CameraCalibration& camera : recording.calibration.cameras) {
    camera.rate_hz *= static_cast<double>(recording.frames.size()) / all;
  }
  return recording;
}

RigCheck checkRig(replay::Dataset& drive, const RigCheckOptions& options) {
  if (!drive.calibration().imu) {
    throw StartupError(ExitCode::kUnavailable,
                       options.data.string() +
                           " has no inertial samples, by which alone a rig can "
                           "be judged; record imu along with the images");
  }
  if (drive.calibration().cameras.empty()) {
    throw StartupError(ExitCode::kUnavailable,
                       options.data.string() + " has no camera; record with --images");
  }
  drive.seek(0);
  Watched watched(options, drive);
  watched.run(drive, options);
  RigCheck check = watched.check();
  if (check.frames == 0 || watched.samples() == 0) {
    throw StartupError(ExitCode::kUnavailable,
                       options.data.string() +
                           " has no images (or no inertial samples) that can be "
                           "read; record with --images");
  }
  return check;
}

Judgements judgeRig(const RigCheck& check) {
  Judgements all;
  const double share = static_cast<double>(check.tracked) / static_cast<double>(check.frames);
  all.push_back(judged(share > 0.7   ? Grade::kGood
                       : share > 0.2 ? Grade::kDoubtful
                                     : Grade::kBad,
                       fmt::format("vio tracked {} of {} images", check.tracked, check.frames),
                       "move with the camera on things that stand, or calibrate anew"));
  if (check.holes > 0) {
    all.push_back({Grade::kBad,
                   fmt::format("stamps jump, or samples are missing, {} times for so long that vio "
                               "began anew; see what writes the recording, or cut it there",
                               check.holes)});
  }
  if (check.resets > check.holes) {
    all.push_back({Grade::kBad, fmt::format("vio lost its way {} times; calibrate anew, or record "
                                            "with the camera on things that stand",
                                            check.resets - check.holes)});
  }
  if (5 * check.speed_refused > check.frames) {
    all.push_back({Grade::kBad, fmt::format("the speed contradicts camera and IMU at {} of {} "
                                            "images; see its unit (m/s), its stamps and the IMU",
                                            check.speed_refused, check.frames)});
  }
  const double against = againstOf(check);
  const bool many_against = against > kManyAgainst;
  if (against > kFewAgainst) {
    all.push_back(
        {many_against ? Grade::kBad : Grade::kDoubtful,
         fmt::format("images contradict the IMU in {:.0f} % of the drive; {}see T_BS (is it the "
                     "inverse?), the IMU's axes, signs and units (radians per second), the focal "
                     "length and time_offset_s, or whether what moves fills the picture{}",
                     100.0 * against, check.even > kFewEven ? kEvenStart : "",
                     many_against
                         ? "; correct nothing by the numbers below before these are excluded"
                         : "")});
    if (check.innovations.size() < kFewest) return all;
  }
  const Judgements belief = judgeBelief(check);
  all.insert(all.end(), belief.begin(), belief.end());
  return all;
}

Judgements judgeBelief(const RigCheck& check) {
  Judgements all;
  if (!check.believed || check.innovations.size() < kFewest) {
    all.push_back({Grade::kDoubtful,
                   fmt::format("there are {} innovations only, too few to judge the rig by; record "
                               "a minute of motion in a place with texture",
                               check.innovations.size())});
    return all;
  }
  const double ratio = innovationRatio(check.innovations);
  all.push_back(judged(gradeOf(ratio, 1.6, 3.0),
                       fmt::format("images meet vio's predictions: median of the innovations "
                                   "{:.2f} of the expected",
                                   ratio),
                       "the rig contradicts the recording: calibrate again"));
  const auto gated =
      std::ranges::count_if(check.innovations, [](const auto& i) { return !i.used; });
  const double left_out =
      static_cast<double>(gated) / static_cast<double>(check.innovations.size());
  all.push_back(judged(gradeOf(left_out, 0.15, 0.35),
                       fmt::format("{:.1f} % of the points were refused by vio", 100 * left_out),
                       "much moves before the camera, images are blurred, or the rig is wrong"));
  const double pattern = patternOf(check.camera, residualsOf(check.innovations));
  const Grade lens = gradeOf(pattern, 0.075, 0.2);
  all.push_back(judged(lens, fmt::format("residuals that stay over the image: {:.3f} px", pattern),
                       "focal length or distortion are wrong: calibrate the lens again"));
  const bool many_against = againstOf(check) > kManyAgainst;
  const Judgement gravity = judgeGravity(check);
  auto place = judgePlaceOf(check, lens == Grade::kGood, !many_against);
  const auto off =
      std::ranges::count_if(place, [](const auto& one) { return one.grade != Grade::kGood; });
  const bool at_once = lens == Grade::kGood && off > 0 && off + (gravity.grade > Grade::kGood) > 1;
  if (at_once && !many_against) {
    judgeAllAtOnce(place, gravity, all);
    place = judgePlaceOf(check, true, false);
  }
  all.insert(all.end(), place.begin(), place.end());
  all.push_back(judged(gradeOf(check.gyro_bias.norm(), 0.1, 0.3),
                       fmt::format("gyroscope bias {:.4f} rad/s, changed by {:.4f} in the second "
                                   "half",
                                   check.gyro_bias.norm(), check.gyro_bias_change),
                       "that is much: does the IMU speak radians, and is it warm?"));
  all.push_back(gravity);
  return all;
}

Judgements judgeSecond(const RigCheck& both, const RigCheck& alone) {
  if (againstOf(both) < kManyAgainst || againstOf(alone) > kFewAgainst ||
      2 * alone.tracked < alone.frames) {
    return {};
  }
  return {{Grade::kBad,
           fmt::format("with the first camera alone images contradict the IMU in {:.0f} % of the "
                       "drive, with both in {:.0f} %: the second camera is wrong; see its T_BS "
                       "(the length of the baseline, too), its images and its stamps",
                       100.0 * againstOf(alone), 100.0 * againstOf(both))}};
}

bool isSecondSuspect(const RigCheck& check) { return againstOf(check) > kManyAgainst; }

}  // namespace perdure::calibrate
