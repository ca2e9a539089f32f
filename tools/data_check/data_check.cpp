#include "tools/data_check/data_check.h"

#include <cstdio>

#include "tools/data_check/axes_check.h"
#include "tools/data_check/motion_check.h"
#include "tools/data_check/pose_check.h"
#include "tools/data_check/stereo_check.h"

namespace perdure::tools {

using Grade = replay::DataFinding::Grade;

replay::DataFindings checkDrive(const replay::Recording& recording, const replay::DataUse& use) {
  replay::DataFindings findings = replay::checkData(recording, use);
  if (!use.images || recording.calibration.cameras.empty()) return findings;
  for (const auto& finding : findings) {
    if (finding.grade == Grade::kFatal) return findings;  // what is said of turns would follow
  }
  const auto stereo = checkStereo(recording);
  findings.insert(findings.end(), stereo.begin(), stereo.end());
  if (!use.imu) return findings;
  const CameraCalibration& camera = recording.calibration.cameras.front();
  const auto turns = turnsOfImages(recording, recording.imu);
  auto of_turns = judgeTurns(turns, recording.imu, camera);
  const bool unit = !of_turns.empty() && of_turns.front().code.starts_with("gyro_");
  // A mirror image looks like a T_BS that is turned or inverted, and is none.
  if (auto axes = judgeAxes(turns, recording.imu, camera); !unit && !axes.empty()) {
    of_turns = std::move(axes);
  }
  findings.insert(findings.end(), of_turns.begin(), of_turns.end());
  return findings;
}

replay::DataFindings checkPoses(const replay::Recording& recording, const replay::PoseFile& file,
                                const replay::DataUse& use) {
  if (recording.calibration.cameras.empty()) return {};
  const auto poses = timedPoses(file, recording);
  auto findings = judgePosesByGyro(poses, recording);
  if (findings.empty() && (use.images || recording.imu.empty())) {
    const CameraCalibration& camera = recording.calibration.cameras.front();
    const auto samples = turnsOfPoses(poses);
    const auto turns = turnsOfImages(recording, samples, use.images ? 60 : 36);
    findings = judgePosesByImages(poses, turns, camera);
    if (findings.empty()) findings = judgePoseTurns(turns, samples, camera);
  }
  if (!findings.empty()) return findings;  // accelerations would follow
  return judgePoseUnit(poses, recording);
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
