#include "tools/data_check/data_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <opencv2/core.hpp>

#include "tools/data_check/axes_check.h"
#include "tools/data_check/axis_changes.h"
#include "tools/data_check/clock_parts.h"
#include "tools/data_check/clock_shift.h"
#include "tools/data_check/frozen_images.h"
#include "tools/data_check/image_flips.h"
#include "tools/data_check/motion_check.h"
#include "tools/data_check/pair_check.h"
#include "tools/data_check/poses/pose_check.h"
#include "tools/data_check/rig_numbers.h"
#include "tools/data_check/samples/mean_force.h"
#include "tools/data_check/samples/sample_blocks.h"
#include "tools/data_check/stereo/stereo_check.h"
#include "tools/data_check/turn_integral.h"

namespace perdure::tools {

using Grade = replay::DataFinding::Grade;

namespace {

/// Runs a check and adds its findings; if OpenCV throws, adds a warning instead.
template <class Check>
void add(const char* of, replay::DataFindings& findings, Check&& check) {
  replay::DataFindings more;
  try {
    more = check();
  } catch (const cv::Exception& error) {
    more = {{Grade::kWarning, "check_failed",
             fmt::format("{} could not be checked: {}", of, error.err)}};
  }
  findings.insert(findings.end(), more.begin(), more.end());
}

/// Whether wrong image stamps explain a finding of changed axes as well, for example if the camera
/// swings.
bool offsetExplainsAxes(const std::vector<Turn>& turns, const std::vector<ImuSample>& samples,
                        CameraCalibration camera) {
  const auto later = offsetOfTurns(turns, samples, camera);
  if (!later) return false;
  camera.time_offset_s = *later;
  return judgeAxes(turns, samples, camera).empty();
}

/// Whether images and gyroscope agree in everything that is judged, so that no more images are
/// needed.
bool surelyAgree(const std::vector<Turn>& turns, const std::vector<ImuSample>& samples,
                 const CameraCalibration& camera) {
  return axesSurelyAgree(turns, samples, camera) && !disagree(turns, samples, camera) &&
         judgeTurns(turns, samples, camera).empty() && judgeAxes(turns, samples, camera).empty() &&
         judgeAxisFactors(turns, samples, camera).empty();
}

constexpr std::size_t kFirst = 36;
constexpr std::size_t kMany = 120;  // an axis with little rotation needs more pairs

/// Checks the axes before it reports `found`, because mirrored axes also resemble a rotated or
/// inverted T_BS.
replay::DataFindings checkAxes(const replay::Recording& recording,
                               const std::vector<ImuSample>& lively, const std::vector<Turn>& turns,
                               const replay::DataFindings& found, KnownTurns& known) {
  const CameraCalibration& camera = recording.calibration.cameras.front();
  auto axes = judgeAxes(turns, recording.imu, camera);
  const bool turned = !found.empty() && found.front().code.starts_with("T_BS_");
  if (!axes.empty() || turned) {
    auto flips = judgeFlips(turnsOfImages(recording, lively, kMany, &known), recording.imu, camera);
    if (!flips.empty()) return flips;
  }
  if (axes.empty() && found.empty()) axes = judgeAxisFactors(turns, recording.imu, camera);
  if (!axes.empty()) {
    const bool offset = !found.empty() && found.front().code == "time_offset";
    if (!offset || !offsetExplainsAxes(turns, recording.imu, camera)) return axes;
    axes.front().text += "; or see the stamps, which explain it as well:";
    axes.front().grade = Grade::kWarning;
    axes.push_back(found.front());
    return axes;
  }
  if (!found.empty() || axesSurelyAgree(turns, recording.imu, camera)) return found;
  return judgeAxisChanges(turnsOfImages(recording, lively, kMany, &known), recording.imu, camera);
}

replay::DataFindings findingsOfTurns(const replay::Recording& recording, KnownTurns& known,
                                     bool whole = true) {
  const CameraCalibration& camera = recording.calibration.cameras.front();
  const auto lively = livelinessOfAxes(recording.imu);
  const auto first = turnsOfImages(recording, lively, kFirst, &known);
  auto parts = offsetsOfParts(first, recording.imu, camera);
  const bool stepped = hasStampStep(recording);
  if (!stepped && !offsetsDiffer(parts, camera) && surelyAgree(first, recording.imu, camera))
    return {};
  const auto turns = turnsOfImages(recording, recording.imu, 60, &known);
  if (auto constant = judgeConstantAxis(turns, recording.imu, camera); !constant.empty())
    return constant;
  for (const auto& part : offsetsOfParts(turns, recording.imu, camera)) parts.push_back(part);
  const bool other = disagree(turns, recording.imu, camera);
  if (whole && (stepped || other || offsetsDiffer(parts, camera))) {
    if (auto clocks = checkClockLine(recording, parts, known); !clocks.empty()) return clocks;
  }
  const auto findings = judgeTurns(turns, recording.imu, camera);
  const bool unit = !findings.empty() && (findings.front().code.starts_with("gyro_") ||
                                          findings.front().code == "images_still");
  if (unit && findings.front().code != "gyro_factor") return findings;
  const auto axes = checkAxes(recording, lively, turns, findings, known);
  return axes.empty() && other ? checkBackwards(recording, known) : axes;
}

/// The rotations of a recording, and what they show.
struct TurnCheck {
  /// The clocks of a part are not judged.
  explicit TurnCheck(const replay::Recording& recording, bool whole) {
    findings = findingsOfTurns(recording, known, whole);
    turns = turnsOfImages(recording, livelinessOfAxes(recording.imu), kFirst, &known);
    contradicted = disagree(turns, recording.imu, recording.calibration.cameras.front());
  }
  /// Whether images and gyroscope clearly turn together.
  bool agrees(const replay::Recording& recording) const {
    constexpr double kAgree = 0.7;  // correlation about the axis that is seen best
    constexpr std::size_t kFewest = 20;
    const auto found =
        correlationOfAxes(turns, recording.imu, recording.calibration.cameras.front());
    return findings.empty() && !contradicted && found.count >= kFewest &&
           found.of.diagonal().maxCoeff() > kAgree;
  }

  KnownTurns known;
  replay::DataFindings findings;
  std::vector<Turn> turns;
  bool contradicted = false;  ///< with or without a finding
};

/// Returns the findings of one half of the drive if the other half has none.
replay::DataFindings judgeHalves(const replay::Recording& recording) {
  std::array<replay::Recording, 2> halves{recording, recording};
  const auto middle = static_cast<std::ptrdiff_t>(recording.frames.size() / 2);
  auto &first = halves[0].frames, &second = halves[1].frames;
  first.erase(first.begin() + middle, first.end());
  second.erase(second.begin(), second.begin() + middle);
  std::array<TurnCheck, 2> checks{TurnCheck(halves[0], false), TurnCheck(halves[1], false)};
  for (const std::size_t bad : {1, 0}) {
    if (!checks[1 - bad].agrees(halves[1 - bad]) || checks[bad].findings.empty()) continue;
    auto findings = checkBackwards(halves[bad], checks[bad].known);
    if (findings.empty()) findings = checks[bad].findings;
    findings.front().text =
        fmt::format("something changes in mid-drive: only {} {} ns, {}; cut the drive there",
                    bad == 1 ? "from about" : "until about", toNanoseconds(second.front().time),
                    findings.front().text);
    return findings;
  }
  return {};
}

/// Whether the rotations of one half of the drive agree with the gyroscope and the others do not.
bool isUneven(const std::vector<Turn>& turns, const replay::Recording& recording) {
  constexpr double kAgree = 0.15, kContradict = 0.4;
  constexpr std::size_t kFewest = 8;
  const CameraCalibration& camera = recording.calibration.cameras.front();
  if (recording.frames.empty()) return false;
  const TimePoint middle = recording.frames[recording.frames.size() / 2].time;
  const Duration later = durationFromSeconds(camera.time_offset_s);
  const TurnIntegral gyro(recording.imu);
  std::array<std::vector<Eigen::Vector3d>, 2> images, said;
  for (const Turn& turn : turns) {
    if (!gyro.covers(turn.from + later, turn.to + later)) continue;
    const std::size_t half = turn.from < middle ? 0 : 1;
    images[half].push_back(turn.of_images);
    said[half].push_back(gyro.between(turn.from + later, turn.to + later));
  }
  if (std::min(images[0].size(), images[1].size()) < kFewest) return false;
  const Eigen::Matrix3d R_CB = camera.T_BC.R().transpose();
  const auto [least, most] = std::minmax({TurnPairs(images[0], said[0]).unexplained(R_CB),
                                          TurnPairs(images[1], said[1]).unexplained(R_CB)});
  return least < kAgree && most > kContradict;
}

replay::DataFindings checkTurns(const replay::Recording& recording) {
  const TurnCheck whole(recording, true);
  // A clock that was set is a change already.
  const bool clocks = !whole.findings.empty() && whole.findings.front().code.starts_with("clock_");
  if (clocks || !isUneven(whole.turns, recording)) return whole.findings;
  auto halves = judgeHalves(recording);
  return halves.empty() ? whole.findings : halves;
}

}  // namespace

replay::DataFindings checkDrive(const replay::Recording& recording, const replay::DataUse& use) {
  replay::DataFindings findings;
  add("the recording", findings, [&] { return replay::checkData(recording, use); });
  add("the rig", findings, [&] { return checkRigNumbers(recording.calibration); });
  if (!use.images || recording.calibration.cameras.empty()) return findings;
  const auto fatal = std::find_if(findings.begin(), findings.end(),
                                  [](const auto& one) { return one.grade == Grade::kFatal; });
  if (fatal != findings.end()) {  // checks of rotations would fail as well
    const auto shift =
        fatal->code == "clocks_apart" ? shiftOfClocks(recording) : std::optional<double>();
    if (shift) *fatal = shiftFinding(*shift, recording.calibration.cameras.front()).front();
    return findings;
  }
  const bool paused =
      std::ranges::any_of(findings, [](const auto& one) { return one.code.starts_with("clock_"); });
  if (use.imu && !paused) add("the samples", findings, [&] { return checkImuGaps(recording); });
  if (use.imu) add("blocks of samples", findings, [&] { return checkSampleBlocks(recording); });
  add("repeated images", findings, [&] { return checkFrozenImages(recording); });
  add("what belongs together", findings, [&] { return checkPairs(recording); });
  add("the two cameras", findings, [&] { return checkStereo(recording); });
  if (!use.imu || std::ranges::any_of(findings, isCause)) return findings;
  const std::size_t before = findings.size();
  add("turning", findings, [&] { return checkTurns(recording); });
  if (findings.size() == before)
    add("the force", findings, [&] { return checkMeanForce(recording.imu); });
  return findings;
}

replay::DataFindings checkPoses(const replay::Recording& recording, const replay::PoseFile& file,
                                const replay::DataUse& use) {
  if (recording.calibration.cameras.empty()) return {};
  auto findings = judgePoseTimes(file, recording);
  if (!findings.empty()) return findings;
  const auto poses = timedPoses(file, recording);
  // After one of these findings, all other checks would fail too.
  findings = judgePosesOfCamera(poses, recording);
  if (findings.empty()) findings = judgePosesBackwards(poses, recording);
  if (findings.empty()) findings = judgePosesFrozen(poses, recording, use.images);
  if (findings.empty()) findings = judgePoseJumps(poses);
  if (!findings.empty()) return findings;
  findings = judgePosesByGyro(poses, recording);
  if (findings.empty() && (use.images || recording.imu.empty())) {
    const CameraCalibration& camera = recording.calibration.cameras.front();
    const auto samples = turnsOfPoses(poses);
    const auto turns = turnsOfImages(recording, samples, use.images ? 60 : 36);
    findings = judgePosesByImages(poses, turns, recording);
    if (findings.empty()) findings = judgePoseTurns(turns, samples, camera);
  }
  if (!findings.empty()) return findings;  // accelerations would fail too
  findings = judgePoseMoving(poses, recording);
  if (findings.empty()) findings = judgePosesByPushes(poses, recording);
  if (findings.empty()) findings = judgePoseAxes(poses, recording);
  if (findings.empty()) findings = judgePoseUnit(poses, recording);
  return findings;
}

nlohmann::ordered_json toJson(const replay::DataFindings& findings) {
  auto list = nlohmann::ordered_json::array();
  for (const auto& finding : findings) {
    list.push_back({{"grade", finding.grade == Grade::kFatal ? "fatal" : "warning"},
                    {"code", finding.code},
                    {"text", finding.text}});
  }
  return list;
}

void printDoubts(const replay::Recording& recording, const replay::DataFindings& findings) {
  for (const std::string& note : recording.notes) std::fprintf(stderr, "note: %s\n", note.c_str());
  for (const auto& finding : findings) {
    const char* word = finding.grade == Grade::kFatal ? "error" : "warning";
    std::fprintf(stderr, "%s: %s\n", word, finding.text.c_str());
  }
}

}  // namespace perdure::tools
