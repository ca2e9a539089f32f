#include "tools/bus_tools/doctor/doctor.h"
#include "tools/calibrate/rig_check.h"

namespace perdure::tools {

Findings checkRigBy(const std::string& recording, const std::string& rig, double seconds) {
  calibrate::RigCheckOptions options;
  options.data = recording, options.rig = rig, options.seconds = seconds;
  Findings findings;
  for (const auto& judgement : calibrate::judgeRig(calibrate::checkRig(options))) {
    const Verdict verdict = judgement.grade == calibrate::Grade::kGood       ? Verdict::kOk
                            : judgement.grade == calibrate::Grade::kDoubtful ? Verdict::kWarn
                                                                             : Verdict::kFail;
    findings.push_back({verdict, judgement.text});
  }
  return findings;
}

}  // namespace perdure::tools
