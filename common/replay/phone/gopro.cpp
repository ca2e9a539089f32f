// Films of GoPro cameras (HERO5 and later), whose track `gpmd` has the samples of gyroscope and
// accelerometer in m/s² and rad/s, about once per second. The samples have no stamps: each packet
// has its time in the film, which varies by some ms, and newer cameras (STMP) also the time of its
// first sample in µs. B has the axes of the samples as they are stored, which differ between the
// cameras.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "common/base/algorithms/folder.h"
#include "common/base/algorithms/median.h"
#include "common/base/errors.h"
#include "common/replay/files/text_file.h"
#include "common/replay/phone/gpmf.h"
#include "common/replay/phone/parts.h"
#include "common/replay/recording.h"
#include "common/vision/film_track.h"

namespace perdure::replay::phone {
namespace {

namespace fs = std::filesystem;

constexpr const char* kTelemetry = "gpmd";
/// Time of the first frame, so that samples from before it have positive stamps.
constexpr TimePoint kStart{std::chrono::seconds(10)};

/// The samples of one sensor in one packet.
struct Block {
  double in_film_s = 0.0;              ///< time of the packet in the film
  std::optional<double> stamp_s = {};  ///< time of the first sample by the camera's clock
  double first = 0.0;                  ///< number of the first sample since the start
  std::vector<Eigen::Vector3d> values;
};

struct Telemetry {
  std::vector<Block> gyro, accel;
  std::vector<Eigen::Quaterniond> image_turns;  ///< of the images against the camera's body
  std::size_t damaged = 0;                      ///< number of packets and blocks
};

const GpmfItem* find(const std::vector<GpmfItem>& items, std::string_view key) {
  const auto found = std::ranges::find(items, key, &GpmfItem::key);
  return found == items.end() ? nullptr : &*found;
}

std::optional<double> numberIn(const std::vector<GpmfItem>& items, std::string_view key) {
  const GpmfItem* item = find(items, key);
  const auto numbers = item == nullptr ? std::vector<double>() : numbersOf(*item);
  return numbers.empty() ? std::nullopt : std::optional(numbers.front());
}

/// The values of an item divided by the scale before it, in groups of N.
template <int N>
std::vector<Eigen::Matrix<double, N, 1>> vectorsOf(const std::vector<GpmfItem>& items,
                                                   const GpmfItem& item) {
  const double scale = numberIn(items, "SCAL").value_or(1.0);
  const auto numbers = numbersOf(item);
  std::vector<Eigen::Matrix<double, N, 1>> vectors;
  if (scale == 0.0 || numbers.size() != N * item.count) return vectors;
  for (std::size_t at = 0; at < numbers.size(); at += N) {
    vectors.push_back(Eigen::Map<const Eigen::Matrix<double, N, 1>>(numbers.data() + at) / scale);
  }
  return vectors;
}

/// Returns false if the block is damaged.
bool addBlock(const std::vector<GpmfItem>& items, const GpmfItem& item, Duration in_film,
              std::vector<Block>& blocks) {
  constexpr double kMicrosecond = 1e-6, kMost_us = 1e15;
  Block block{.in_film_s = toSeconds(in_film), .values = vectorsOf<3>(items, item)};
  if (block.values.empty()) return item.count == 0;
  const auto stamp = numberIn(items, "STMP"), total = numberIn(items, "TSMP");
  if (stamp && std::abs(*stamp) < kMost_us) block.stamp_s = *stamp * kMicrosecond;
  const double before =
      blocks.empty() ? 0.0 : blocks.back().first + static_cast<double>(blocks.back().values.size());
  block.first = total ? *total - static_cast<double>(block.values.size()) : before;
  if (!blocks.empty() && !(block.first > blocks.back().first)) return false;
  blocks.push_back(std::move(block));
  return true;
}

void addStream(const std::vector<GpmfItem>& items, Duration in_film, Telemetry& telemetry) {
  for (const GpmfItem& item : items) {
    const bool gyro = item.key == "GYRO";
    if (gyro || item.key == "ACCL") {
      auto& blocks = gyro ? telemetry.gyro : telemetry.accel;
      if (!addBlock(items, item, in_film, blocks)) ++telemetry.damaged;
    }
    if (item.key != "IORI") continue;
    for (const Eigen::Vector4d& q : vectorsOf<4>(items, item)) {
      if (q.norm() > 0.5) {
        telemetry.image_turns.push_back(Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized());
      }
    }
  }
}

/// Adds the streams in an item and in the items inside of it. Returns false if one is damaged.
bool addItems(std::string_view text, Duration in_film, Telemetry& telemetry, int depth = 0) {
  constexpr int kDeepest = 4;  // devices contain streams, and these samples
  const auto items = itemsOf(text);
  if (!items) return false;
  addStream(*items, in_film, telemetry);
  bool sound = true;
  for (const GpmfItem& item : *items) {
    if (item.type != 0 || depth == kDeepest) continue;
    sound = addItems(item.data, in_film, telemetry, depth + 1) && sound;
  }
  return sound;
}

Telemetry readTelemetry(const fs::path& film, Recording& recording) {
  refuseUnreadable(film);
  const auto packets = vision::readFilmTrack(film, kTelemetry);
  if (!packets) {
    const bool converted = packets.error().code == "film_no_track";
    throw StartupError(ExitCode::kData, "{}{}", packets.error().detail,
                       converted ? ", so there are no inertial samples: copy the file as the "
                                   "camera (GoPro, HERO5 or later) wrote it, not converted"
                                 : "");
  }
  Telemetry telemetry;
  for (const vision::FilmPacket& packet : *packets) {
    if (!addItems(packet.bytes, packet.start, telemetry)) ++telemetry.damaged;
  }
  if (telemetry.damaged > 0) recording.reasons.add("telemetry_damaged", telemetry.damaged);
  return telemetry;
}

/// The time of each block's first sample in the film, if their packets vary around a constant rate.
std::vector<double> timesByPackets(const std::vector<Block>& blocks) {
  const auto count = static_cast<Eigen::Index>(blocks.size());
  Eigen::MatrixX2d line(count, 2);
  Eigen::VectorXd times(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Block& block = blocks[static_cast<std::size_t>(i)];
    line.row(i) << 1.0, block.first;
    times[i] = block.in_film_s;
  }
  const Eigen::VectorXd fitted = line * line.colPivHouseholderQr().solve(times);
  return {fitted.begin(), fitted.end()};
}

/// Offset from the camera's clock, which both sensors share, to the time in the film; nothing if a
/// block has no stamp.
std::optional<double> clockOffset(const Telemetry& telemetry) {
  std::vector<double> offsets;
  for (const auto* blocks : {&telemetry.gyro, &telemetry.accel}) {
    for (const Block& block : *blocks) {
      if (!block.stamp_s) return std::nullopt;
      offsets.push_back(block.in_film_s - *block.stamp_s);
    }
  }
  return medianOf(std::move(offsets));
}

std::vector<double> timesByStamps(const std::vector<Block>& blocks, double offset) {
  std::vector<double> times;
  for (const Block& block : blocks) times.push_back(*block.stamp_s + offset);
  return times;
}

/// Seconds from sample to sample over all blocks.
double usualStep(const std::vector<Block>& blocks, const std::vector<double>& times,
                 const std::string& where) {
  constexpr double kLeast_s = 1e-5, kMost_s = 0.5;
  const double step_s =
      (times.back() - times.front()) / (blocks.back().first - blocks.front().first);
  if (step_s > kLeast_s && step_s < kMost_s) return step_s;
  throw StartupError(ExitCode::kData,
                     "{}: by the stamps of its telemetry a sample lasts {:.3g} s; the telemetry is "
                     "damaged: copy the file again",
                     where, step_s);
}

Stream streamOf(const std::vector<Block>& blocks, std::optional<double> offset,
                const std::string& where) {
  constexpr double kRateWithin = 0.1;  // beyond this share, samples were lost between two blocks
  if (blocks.size() < 2) {
    throw StartupError(ExitCode::kData,
                       "{}: its telemetry has {} packets with gyroscope and accelerometer, but two "
                       "are needed: record for at least 3 s",
                       where, blocks.size());
  }
  const auto times = offset ? timesByStamps(blocks, *offset) : timesByPackets(blocks);
  const double usual_s = usualStep(blocks, times, where);
  Stream stream;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    double step_s = usual_s;
    if (i + 1 < blocks.size()) {
      step_s = (times[i + 1] - times[i]) / (blocks[i + 1].first - blocks[i].first);
    }
    if (std::abs(step_s - usual_s) > kRateWithin * usual_s) step_s = usual_s;
    for (std::size_t k = 0; k < blocks[i].values.size(); ++k) {
      const double time_s = times[i] + step_s * static_cast<double>(k);
      stream.push_back({kStart + durationFromSeconds(time_s), blocks[i].values[k]});
    }
  }
  return stream;
}

/// Refuses films whose images the camera turned to hide its own motion.
void refuseStabilised(const Telemetry& telemetry, const std::string& where) {
  constexpr double kMost_rad = M_PI / 180.0;
  double most_rad = 0.0;
  for (const auto& turn : telemetry.image_turns) {
    most_rad = std::max(most_rad, turn.angularDistance(telemetry.image_turns.front()));
  }
  if (most_rad <= kMost_rad) return;
  throw StartupError(ExitCode::kData,
                     "{}: the film is stabilised (HyperSmooth): its images are turned by up to "
                     "{:.0f}° against the camera, so they do not move as the inertial unit does; "
                     "record with stabilisation off",
                     where, most_rad * 180.0 / M_PI);
}

bool looksLikeGoPro(const fs::path& path) {
  if (fs::is_regular_file(path)) return isFilmName(path);
  const auto films = pathsIn(path, isFilmName);
  return std::ranges::any_of(
      films, [](const auto& film) { return vision::hasFilmTrack(film, kTelemetry); });
}

fs::path filmOfGoPro(const fs::path& path) {
  if (fs::is_regular_file(path)) return path;
  const fs::path only = onlyFilm(path);
  if (!only.empty()) return only;
  const auto films = pathsIn(path, isFilmName);
  throw StartupError(ExitCode::kData,
                     "{} has {} films: give one of them, such as --data {}; parts of one recording "
                     "are used one by one",
                     path.string(), films.size(), films.front().string());
}

Parts readGoPro(const fs::path& path, Recording& recording) {
  Parts parts;
  PhoneCamera camera;
  camera.film = filmOfGoPro(path), camera.film_start = kStart;
  parts.where = camera.film.string();
  const Telemetry telemetry = readTelemetry(camera.film, recording);
  refuseStabilised(telemetry, parts.where);
  const auto offset = clockOffset(telemetry);
  parts.gyro = streamOf(telemetry.gyro, offset, parts.where);
  parts.accel = streamOf(telemetry.accel, offset, parts.where);
  orderByTime(parts.gyro, "imu", parts.where, recording);
  orderByTime(parts.accel, "accel", parts.where, recording);
  recording.notes.push_back(parts.where +
                            ": the stamps of telemetry and frames may differ by some 10 ms; "
                            "`perdure calibrate from-motion` finds this time_offset_s");
  if (telemetry.image_turns.empty()) {
    recording.notes.push_back(parts.where +
                              ": this camera does not say whether the film is stabilised; record "
                              "with stabilisation off, or images contradict the inertial unit");
  }
  parts.cameras.push_back(std::move(camera));
  return parts;
}

}  // namespace

const Format kGoPro{looksLikeGoPro, readGoPro};

}  // namespace perdure::replay::phone
