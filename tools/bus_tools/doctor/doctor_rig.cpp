#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <future>
#include <memory>
#include <stop_token>

#include "tools/bus_tools/doctor/doctor.h"
#include "tools/calibrate/motion/from_motion.h"
#include "tools/calibrate/rig_check.h"
#include "tools/data_check/clock_parts.h"
#include "tools/data_check/data_check.h"
#include "tools/data_check/repaired_copy.h"
#include "tools/data_check/repaired_text.h"

namespace perdure::tools {
namespace {

bool isFatal(const replay::DataFinding& finding) {
  return finding.grade == replay::DataFinding::Grade::kFatal;
}

bool isUsable(const replay::DataFindings& of_data) {
  return std::ranges::none_of(of_data, isFatal);
}

void addFindings(const replay::DataFindings& of_data, Findings& findings) {
  for (const auto& finding : of_data) {
    findings.push_back({isFatal(finding) ? Verdict::kFail : Verdict::kWarn, finding.text});
  }
}

replay::DatasetOptions inGrey(const Drive& drive) {
  return {.path = drive.data,
          .sequence = drive.sequence,
          .encoding = ImageEncoding::kMono8,
          .second_encoding = ImageEncoding::kMono8,
          .rig = drive.rig};
}

void checkPosesOf(const Drive& drive, const replay::Recording& recording, Findings& findings) {
  if (drive.poses.empty()) return;
  const auto of_poses = checkPoses(recording, replay::PoseFile::read(drive.poses), {});
  addFindings(of_poses, findings);
  if (of_poses.empty()) {
    findings.push_back({Verdict::kOk, "the poses agree with images and inertial samples"});
  }
}

/// Adds the findings about the rig from the motion, which are the most exact ones.
void checkMotionOf(const replay::Recording& recording, replay::DataFindings& of_data,
                   Findings& findings) {
  const auto is_coarse = [](const replay::DataFinding& finding) {
    return finding.code == "time_offset" || finding.code == "gyro_factor";
  };
  if (!std::ranges::all_of(of_data, is_coarse)) return;
  if (recording.imu.empty() || recording.calibration.cameras.empty()) return;
  const auto check = calibrate::checkMotion(recording);
  if (!check.findings.empty()) of_data = check.findings;
  findings.push_back({Verdict::kOk, check.basis});
}

/// Checks the recording. Returns whether it is usable for checking the rig with vio.
bool checkRecording(const Drive& drive, const replay::Recording& recording, Findings& findings) {
  // The warnings about 7-Scenes are about data that its layout lacks; they are no faults.
  const bool scenes = recording.kind == replay::DatasetKind::kSevenScenes;
  const bool of_layout = scenes || recording.kind == replay::DatasetKind::kKittiTracking;
  for (const auto& note : recording.notes) {
    findings.push_back({of_layout ? Verdict::kOk : Verdict::kWarn, note});
  }
  auto of_data = checkDrive(recording, {});
  if (findings.empty() && of_data.empty()) {
    findings.push_back({Verdict::kOk, "stamps, units, images and axes agree"});
  }
  const bool usable = isUsable(of_data), without_imu = of_layout && !recording.calibration.imu;
  checkMotionOf(recording, of_data, findings);
  addFindings(of_data, findings);
  if (usable) checkPosesOf(drive, recording, findings);
  if (usable && std::ranges::any_of(of_data, isCause)) {
    findings.push_back({Verdict::kFail,
                        "vio was not run, because it would only show the consequences: correct "
                        "what is named above, and check again"});
    return false;
  }
  if (usable && without_imu) {
    findings.push_back(
        {Verdict::kOk,
         fmt::format("there are no inertial samples, as always in {}: the rig is not judged, and "
                     "vio cannot run; --odometry {}",
                     scenes ? "7-Scenes" : "KITTI tracking",
                     scenes ? "truth takes the poses" : "takes a file of poses")});
  }
  return usable && !without_imu;
}

void showProgress(std::size_t done, std::size_t all) {
  constexpr std::size_t kEvery = 50;
  if (!isatty(STDERR_FILENO) || (done % kEvery != 0 && done != all)) return;
  std::fprintf(stderr, "\r%zu of %zu images%s", done, all, done == all ? "\n" : "");
}

}  // namespace

void settleUpsideDown(bool vio_agrees, Findings& findings) {
  if (!vio_agrees) return;
  for (Finding& finding : findings) {
    if (finding.text.find(replay::kUpsideDown) == std::string::npos) continue;
    finding = {Verdict::kOk,
               "the camera hangs upside down, as T_BS has it, and vio agrees; objects are found "
               "better in images that are turned"};
  }
}

Findings checkRigBy(const Drive& drive, std::optional<double> seconds) {
  Findings findings;
  calibrate::RigCheckOptions options;
  options.data = drive.data, options.until_sure = !seconds;
  if (seconds) options.seconds = *seconds;
  const auto read = replay::Dataset::open(inGrey(drive));
  const replay::Recording& recording = read->recording();
  replay::Dataset of_vio(inGrey(drive), seconds ? recording : calibrate::thinned(recording));
  // Vio runs beside the other checks, except over images that can only be read one after another.
  const bool files = std::ranges::none_of(recording.frames, [](auto& one) { return !!one.load; });
  std::stop_source others_failed;
  options.stop = others_failed.get_token();
  auto run = std::async(files ? std::launch::async : std::launch::deferred,
                        [&] { return calibrate::checkRig(of_vio, options); });
  const std::unique_ptr<std::stop_source, void (*)(std::stop_source*)> at_end(
      &others_failed, [](std::stop_source* source) { source->request_stop(); });
  if (!checkRecording(drive, recording, findings)) return findings;
  const auto check = run.get();
  auto judgements = calibrate::judgeRig(check);
  settleUpsideDown(calibrate::worstOf(judgements) == calibrate::Grade::kGood, findings);
  if (check.cameras > 1 && calibrate::isSecondSuspect(check)) {
    options.vio.stereo = false;
    const auto second = calibrate::judgeSecond(check, calibrate::checkRig(of_vio, options));
    judgements.insert(judgements.begin(), second.begin(), second.end());
  }
  const bool bad = calibrate::worstOf(judgements) == calibrate::Grade::kBad;
  if (const auto jumps = suspectJumps(recording); bad && !jumps.empty()) {
    findings.push_back({Verdict::kWarn, jumps + ": if a clock was set there, this explains what "
                                                "follows; exclude it first"});
  }
  for (const auto& judgement : judgements) {
    const Verdict verdict = judgement.grade == calibrate::Grade::kGood       ? Verdict::kOk
                            : judgement.grade == calibrate::Grade::kDoubtful ? Verdict::kWarn
                                                                             : Verdict::kFail;
    findings.push_back({verdict, judgement.text});
  }
  return findings;
}

Findings fixRecording(const Drive& given, const std::string& folder) {
  const RepairedText text(given.data);
  const auto dataset =
      replay::Dataset::open({.path = text.drive(), .sequence = given.sequence, .rig = given.rig});
  const RepairedDrive drive = repairDrive(dataset->recording());
  Findings findings;
  for (const auto& fix : text.fixes()) findings.push_back({Verdict::kOk, fix});
  for (const auto& note : dataset->recording().notes) findings.push_back({Verdict::kOk, note});
  for (const auto& [reason, count] : dataset->recording().reasons.all()) {
    findings.push_back(
        {Verdict::kOk, "counted while reading: " + reason + ", " + std::to_string(count)});
  }
  for (const auto& fix : drive.fixes) findings.push_back({Verdict::kOk, fix});
  if (findings.empty() && given.rig.empty()) {
    addFindings(drive.left, findings);
    if (isUsable(drive.left)) {
      findings.push_back({Verdict::kOk, "there is nothing to fix; no copy is written"});
    } else {
      findings.push_back({Verdict::kWarn, "no correction of this is certain; no copy is written"});
    }
    return findings;
  }
  if (const auto left_out = writeDrive(drive.recording, folder, showProgress)) {
    findings.push_back(
        {Verdict::kWarn, std::to_string(left_out) + " images cannot be read and are left out"});
  }
  findings.push_back({Verdict::kOk, "written: " + folder});
  const Drive copy{.data = folder};
  checkRecording(copy, replay::Dataset::open(inGrey(copy))->recording(), findings);
  return findings;
}

}  // namespace perdure::tools
