// Random damages of a sound drive: bytes, lines, files and stamps. A run of a damaged drive ends
// with an error, or with a warning, or with the trajectory of the sound drive to a tenth.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "common/base/errors.h"
#include "common/replay/files/text_file.h"
#include "tests/common/replay/tiny_datasets.h"
#include "tools/pipeline/pipeline.h"
#include "tools/simulate/simulate.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using Lines = std::vector<std::string>;
using Poses = std::map<std::uint64_t, replay::StampedPose>;

Lines linesOf(const fs::path& file) {
  Lines lines;
  for (auto& line : replay::readLines(file, "")) lines.push_back(std::move(line.text));
  return lines;
}

void write(const fs::path& file, const Lines& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  replay::writeText(file, text);
}

/// Applies one damage to a copy of the drive.
class Damage {
 public:
  Damage(fs::path root, std::uint64_t seed) : mav0_(root / "mav0"), random_(seed) {}

  /// Returns what was done.
  std::string apply() {
    constexpr std::array kKinds{&Damage::bytes, &Damage::lines, &Damage::files, &Damage::stamps};
    return (this->*kKinds[below(kKinds.size())])();
  }

 private:
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(random_() % n); }
  /// 10^low … 10^high.
  double power(double low, double high) {
    return std::pow(10.0, low + (high - low) * static_cast<double>(below(1000)) / 1000.0);
  }
  fs::path table() { return mav0_ / (below(2) == 0 ? "imu0" : "cam0") / "data.csv"; }
  std::vector<fs::path> images() const {
    std::vector<fs::path> all;
    for (const auto& entry : fs::directory_iterator(mav0_ / "cam0/data")) all.push_back(entry);
    std::sort(all.begin(), all.end());
    return all;
  }

  std::string bytes() {
    const std::vector<fs::path> all = images();
    const std::array files{table(), mav0_ / "cam0/sensor.yaml", mav0_ / "imu0/sensor.yaml",
                           all[below(all.size())]};
    const fs::path& file = files[below(files.size())];
    std::string text = replay::readText(file);
    const std::size_t count = 1 + below(20);
    for (std::size_t i = 0; i < count; ++i)
      text[below(text.size())] = static_cast<char>(random_() & 0xff);
    replay::writeText(file, text);
    return std::to_string(count) + " bytes of " + file.filename().string();
  }

  std::string lines() {
    const fs::path file = table();
    Lines all = linesOf(file);
    const std::size_t rows = all.size() - 1, first = 1 + below(rows - 1);
    const std::size_t count = std::min(all.size() - first, 1 + below(rows / 3));
    const auto begin = all.begin() + static_cast<std::ptrdiff_t>(first);
    const auto end = begin + static_cast<std::ptrdiff_t>(count);
    const std::string where = std::to_string(count) + " lines from " + std::to_string(first) +
                              " of " + file.parent_path().filename().string();
    std::string what;
    switch (below(6)) {
      case 0:
        all.erase(begin, end), what = "lost: ";
        break;
      case 1:
        all.resize(first + 1), what = "cut behind: ";
        break;
      case 2:
        std::shuffle(begin, end, random_), what = "shuffled: ";
        break;
      case 3: {
        const Lines copy(begin, end);
        all.insert(all.end(), copy.begin(), copy.end()), what = "copied: ";
        break;
      }
      case 4:
        for (auto line = begin; line != end; ++line) line->resize(below(line->size()) + 1);
        what = "shortened: ";
        break;
      default:
        std::rotate(all.begin() + 1, begin, all.end()), what = "rotated: ";
    }
    write(file, all);
    return what + where;
  }

  std::string files() {
    std::vector<fs::path> all = images();
    const std::size_t count = 1 + below(all.size() / 3), first = below(all.size() - count);
    const std::string where = std::to_string(count) + " images from " + std::to_string(first);
    const std::size_t kind = below(4);
    for (std::size_t i = first; i < first + count; ++i) {
      if (kind == 0) fs::remove(all[i]);
      if (kind == 1) replay::truncate(all[i], 0.3);
      if (kind == 2) replay::writeText(all[i], "");
      if (kind == 3) replay::writeText(all[i], replay::readText(all[first]));
    }
    return std::array{"lost: ", "cut: ", "empty: ", "repeated: "}[kind] + where;
  }

  std::string stamps() {
    const std::size_t kind = below(7);
    const bool both = below(3) == 0;
    const auto by = static_cast<std::int64_t>(power(7, 12)) * (below(2) == 0 ? 1 : -1);
    const double share = 0.2 + 0.6 * static_cast<double>(below(100)) / 100.0;
    const std::size_t only = below(2);
    std::string of;
    for (const char* sensor : {"imu0", "cam0"}) {
      if (!both && (only == 0) != (sensor[0] == 'i')) continue;
      of += std::string(" ") + sensor;
      change(mav0_ / sensor / "data.csv", kind, by, share);
    }
    return std::array{"moved by ", "set by ",   "in µs, ",      "faster, ",
                      "jitter, ",  "wrapped, ", "lost digits, "}[kind] +
           std::to_string(by) + " ns at " + std::to_string(share) + of;
  }

  void change(const fs::path& file, std::size_t kind, std::int64_t by, double share) {
    Lines all = linesOf(file);
    const std::int64_t start = std::stoll(all[1]);
    for (std::size_t i = 1; i < all.size(); ++i) {
      const std::size_t comma = all[i].find(',');
      std::int64_t t = std::stoll(all[i].substr(0, comma));
      const bool late = static_cast<double>(i) > share * static_cast<double>(all.size());
      if (kind == 0 || (kind == 1 && late)) t += by;
      if (kind == 2) t /= 1000;
      if (kind == 3) t += static_cast<std::int64_t>(share * 0.2 * static_cast<double>(t - start));
      if (kind == 4) t += static_cast<std::int64_t>(below(20'000'000));
      if (kind == 5) t = (t - start + 4'290'000'000) % 4'294'967'296;
      if (kind == 6) t -= t % 100'000'000;
      all[i] = std::to_string(t) + all[i].substr(comma);
    }
    write(file, all);
  }

  fs::path mav0_;
  std::mt19937_64 random_;
};

struct Outcome {
  std::string error, warning;
  Poses poses;
};

Outcome outcomeOf(const fs::path& drive) {
  PipelineOptions options;
  options.data = drive.string();
  options.odometry = "vio";
  options.detections = "none";
  options.out = (drive.parent_path() / "out").string();
  Outcome outcome;
  try {
    Pipeline pipeline(options);
    pipeline.run([](const PipelineCounts&) {});
    pipeline.finish();
    outcome.poses = pipeline.outputs().poses();
    outcome.warning = endOfLine(pipeline.doubts());
    for (const auto& one : pipeline.findings()) outcome.warning += " | " + one.text;
    pipeline.refuseNothing();
  } catch (const StartupError& error) {
    outcome.error = error.what();
  }
  return outcome;
}

/// Gives poses the numbers of the sound drive's frames if most of the times are still the same.
Poses numberedAs(const Poses& sound, const Poses& poses) {
  std::map<TimePoint, std::uint64_t> numbers;
  for (const auto& [frame, pose] : sound) numbers[pose.time] = frame;
  Poses numbered;
  for (const auto& [frame, pose] : poses) {
    const auto number = numbers.find(pose.time);
    if (number != numbers.end()) numbered[number->second] = pose;
  }
  return 2 * numbered.size() > poses.size() ? numbered : poses;
}

/// The error of the steps of half a second, as a share of their length; or the share of the frames
/// that have no pose, if it is larger.
double errorOf(const Poses& poses, const Poses& sound) {
  constexpr std::uint64_t kStep = 10;
  double error = 0.0, length = 0.0, missing = 0.0;
  for (const auto& [frame, from] : sound) {
    missing += poses.contains(frame) ? 0.0 : 1.0;
    const auto to = sound.find(frame + kStep);
    if (to == sound.end()) continue;
    const Eigen::Vector3d step = (from.T_WB.inverse() * to->second.T_WB).p;
    const auto a = poses.find(frame), b = poses.find(frame + kStep);
    if (a == poses.end() || b == poses.end()) continue;
    length += step.norm();
    error += ((a->second.T_WB.inverse() * b->second.T_WB).p - step).norm();
  }
  const double share = missing / static_cast<double>(sound.size());
  return length == 0.0 ? 1.0 : std::max(error / length, share);
}

fs::path soundDrive() {
  SimulateOptions simulation;
  simulation.scene = "street";
  simulation.seed = 6;
  simulation.world.seconds = 6.0;
  simulation.world.width = 320, simulation.world.height = 240;
  simulation.format = ImageFormat::kJpeg;
  simulation.out = replay::freshFolder("sound") / "drive";
  simulate(simulation, {});
  return simulation.out;
}

/// PERDURE_DAMAGES: their number; PERDURE_DAMAGE: one seed.
std::uint64_t numberOf(const char* variable, std::uint64_t otherwise) {
  const char* text = std::getenv(variable);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

TEST(Damages, EndWithAnErrorAWarningOrTheSoundResult) {
  const fs::path drive = soundDrive();
  const Outcome sound = outcomeOf(drive);
  ASSERT_EQ(sound.error + sound.warning, "");
  const std::uint64_t first = numberOf("PERDURE_DAMAGE", 1);
  const std::uint64_t last = first + numberOf("PERDURE_DAMAGES", 20) - 1;
  int refused = 0, warned = 0, right = 0;
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    const fs::path copy = replay::freshFolder("damaged") / "drive";
    fs::copy(drive, copy, fs::copy_options::recursive);
    const std::string what = Damage(copy, seed).apply();
    const Outcome outcome = outcomeOf(copy);
    // After a lost line all frames have other numbers; after a step of the clock, other times.
    const double error = std::min(errorOf(outcome.poses, sound.poses),
                                  errorOf(numberedAs(sound.poses, outcome.poses), sound.poses));
    std::printf("%llu, %s: %.3f off%s%s\n", static_cast<unsigned long long>(seed), what.c_str(),
                error, outcome.error.empty() ? "" : (", refused: " + outcome.error).c_str(),
                outcome.warning.c_str());
    std::fflush(stdout);
    ++(!outcome.error.empty() ? refused : !outcome.warning.empty() ? warned : right);
    if (outcome.error.empty() && outcome.warning.empty()) {
      EXPECT_LT(error, 0.1) << "seed " << seed << ", " << what;
    }
  }
  std::printf("%d refused, %d with a warning, %d right\n", refused, warned, right);
}

}  // namespace
}  // namespace perdure::tools
