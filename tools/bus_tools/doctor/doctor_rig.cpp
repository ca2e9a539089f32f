#include "tools/bus_tools/doctor/doctor.h"
#include "tools/calibrate/rig_check.h"
#include "tools/data_check/data_check.h"

namespace perdure::tools {
namespace {

/// Whether vio can run over it at all.
bool checkRecording(const std::string& data, const std::string& rig, Findings& findings) {
  using Grade = replay::DataFinding::Grade;
  const auto dataset = replay::Dataset::open({.path = data, .rig = rig});
  for (const auto& note : dataset->recording().notes) findings.push_back({Verdict::kWarn, note});
  bool usable = true;
  for (const auto& finding : checkDrive(dataset->recording(), {})) {
    const bool fatal = finding.grade == Grade::kFatal;
    findings.push_back({fatal ? Verdict::kFail : Verdict::kWarn, finding.text});
    usable = usable && !fatal;
  }
  if (findings.empty()) findings.push_back({Verdict::kOk, "stamps, units, images and axes agree"});
  return usable;
}

}  // namespace

Findings checkRigBy(const std::string& recording, const std::string& rig, double seconds) {
  Findings findings;
  if (!checkRecording(recording, rig, findings)) return findings;
  calibrate::RigCheckOptions options;
  options.data = recording, options.rig = rig, options.seconds = seconds;
  for (const auto& judgement : calibrate::judgeRig(calibrate::checkRig(options))) {
    const Verdict verdict = judgement.grade == calibrate::Grade::kGood       ? Verdict::kOk
                            : judgement.grade == calibrate::Grade::kDoubtful ? Verdict::kWarn
                                                                             : Verdict::kFail;
    findings.push_back({verdict, judgement.text});
  }
  return findings;
}

}  // namespace perdure::tools
