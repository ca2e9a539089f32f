#include "tools/pipeline/doubts.h"

#include <fmt/format.h>

namespace perdure::tools {
namespace {

/// A message that is due if more than one frame in `one_of` has the reason.
struct Doubt {
  const char* code;
  std::uint64_t one_of;
  const char *what, *mend;
};

constexpr Doubt kDoubts[] = {
    {"images_contradict_imu", 20, "images contradict the IMU",
     "T_BS, the IMU's axes, signs or units, the focal length or time_offset_s may be wrong; see "
     "perdure doctor --data"},
    {"position_uncertain", 20, "the position is uncertain",
     "its deviation grew by more than vio.odometry.position_growth in ten seconds, and no object "
     "was "
     "confirmed meanwhile: turn less on the spot, or calibrate the rig (perdure doctor --data)"},
    {"poses_contradict_images", 20, "the poses contradict the images",
     "they may be inverted (T_BW for T_WB), in other axes than T_BS says, with the quaternion's w "
     "at the wrong end, or on another clock"},
    {"points_too_far", 20, "nearly all points lie beyond vision.max_depth",
     "see that the poses are in metres, or raise it"},
    {"speed_gated", 5, "the speed contradicts camera and IMU and was refused",
     "see its unit (m/s), its stamps and the IMU, or leave it away (vio.speed.enabled=false)"},
};

}  // namespace

std::vector<std::string> doubtsOfRun(const ReasonCounts& vio, std::uint64_t frames,
                                     std::uint64_t without_pose) {
  std::vector<std::string> doubts;
  for (const Doubt& doubt : kDoubts) {
    const std::uint64_t times = vio.of(doubt.code);
    if (doubt.one_of * times <= frames) continue;
    doubts.push_back(
        fmt::format("{} at {} of {} frames: {}", doubt.what, times, frames, doubt.mend));
  }
  if (const std::uint64_t times = vio.of("reset"); times > 0) {
    doubts.push_back(
        fmt::format("vio lost its way {} times and began anew: what came before and after is not "
                    "in one frame of reference; perdure doctor --data says why",
                    times));
  }
  if (4 * without_pose > frames) {
    doubts.push_back(
        fmt::format("{} of {} frames have no pose and were left out: give poses of the whole "
                    "drive, at most .5 s apart",
                    without_pose, frames));
  }
  return doubts;
}

std::vector<std::string> doubtsOfRig(const calibrate::RigCheck& check) {
  std::vector<std::string> doubts;
  for (const auto& judgement : calibrate::judgeBelief(check)) {
    if (judgement.grade == calibrate::Grade::kBad)
      doubts.push_back("the rig, or an axis of the IMU, does not fit the run: " + judgement.text);
  }
  return doubts;
}

}  // namespace perdure::tools
