#include "tools/outputs/run_doubts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

namespace perdure::tools {
namespace {

/// A warning that is given if more than one frame in `one_of` has the reason `code`.
struct Rule {
  const char* code;
  std::uint64_t one_of;
  const char *what, *fix;
};

constexpr Rule kRules[] = {
    {"frame_without_update", 10, "no image point could be used",
     "their poses are from the IMU alone; check exposure, contrast, size and lens of the images"},
    {"start_picture_moves_imu_does_not", 20, "the images moved but the IMU did not",
     "if the drive begins in even motion, an IMU shows neither speed nor tilt: begin at rest or in "
     "a turn, or record a speed; otherwise check the IMU"},
    {"images_contradict_imu", 20, "images contradict the IMU",
     "T_BS, the IMU's axes, signs or units, the focal length, time_offset_s or the order of the "
     "images may be wrong; see perdure doctor --data"},
    {"position_uncertain", 20, "the position is uncertain",
     "its standard deviation grew by more than vio.odometry.position_growth in ten seconds: turn "
     "less on the spot, or calibrate the rig (perdure doctor --data)"},
    {"poses_contradict_images", 20, "the poses contradict the images",
     "they may be inverted (T_BW for T_WB), in other axes than T_BS says, with the quaternion's w "
     "at the wrong end, or on another clock"},
    {"points_too_far", 20, "nearly all points lie beyond vision.max_depth",
     "check that the poses are in metres, or raise the limit"},
    {"speed_gated", 5, "the speed contradicts camera and IMU and was refused",
     "check its unit (m/s), its stamps and the IMU, or disable it (vio.speed.enabled=false)"},
};

std::string sentenceOf(const Doubt& doubt) { return doubt.what + ": " + doubt.fix; }

Doubts doubtsOfFindings(const replay::DataFindings& findings) {
  Doubts doubts;
  for (const auto& [grade, code, text] : findings) {
    if (grade != replay::DataFinding::Grade::kNote) doubts.push_back({code, text});
  }
  return doubts;
}

}  // namespace

std::uint64_t imagesLost(const ReasonCounts& capture) {
  std::uint64_t count = capture.of("frame_malformed") + capture.of("frame_stray");
  for (const auto& [code, times] : capture.all()) {
    if (code.starts_with("image_")) count += times;
  }
  return count;
}

Doubts doubtsOfRun(const RunFacts& facts) {
  Doubts doubts = doubtsOfFindings(facts.findings);
  const bool caused = std::ranges::any_of(facts.findings, [](const auto& finding) {
    return finding.grade == replay::DataFinding::Grade::kCause;
  });
  const char* first = caused ? "see the cause above; otherwise " : "";
  for (const Rule& rule : kRules) {
    const std::uint64_t times = facts.vio.of(rule.code);
    if (rule.one_of * times <= facts.frames) continue;
    doubts.push_back({fmt::format("{} at {} of {} frames", rule.what, times, facts.frames),
                      std::string(first) + rule.fix});
  }
  if (const std::uint64_t times = facts.vio.of("reset"); times > 0) {
    doubts.push_back(
        {fmt::format("vio was reset {} times", times),
         "poses before and after a reset are not in one frame of reference; perdure doctor "
         "--data reports the cause"});
  }
  constexpr std::uint64_t kOneLost = 20;  // tolerates one lost image in 20; recordings lose some
  const std::uint64_t lost = imagesLost(facts.capture), all = facts.frames + lost;
  if (kOneLost * lost > all) {
    doubts.push_back(
        {fmt::format("{} of {} images are missing or cannot be read", lost, all),
         "report.json counts the reasons of capture; download or copy the drive again"});
  }
  if (10 * facts.without_pose > facts.frames) {
    doubts.push_back({fmt::format("{} of {} frames have no pose and were not used",
                                  facts.without_pose, facts.frames),
                      "provide poses of the whole drive, at most 0.5 s apart"});
  }
  if (facts.poses && 2 * *facts.poses < facts.frames && facts.without_pose == 0) {
    doubts.push_back({fmt::format("only {} of {} frames have a pose", *facts.poses, facts.frames),
                      "the map has only what these frames show; perdure doctor --data reports why "
                      "vio starts late or waits"});
  }
  if (facts.boxes > 0 && facts.objects == 0) {
    doubts.push_back({fmt::format("the map is empty although there are {} boxes", facts.boxes),
                      "check that they belong to these frames, that their classes are known, and "
                      "that the camera moves past the objects"});
  }
  return doubts;
}

std::string endOfLine(const Doubts& doubts) {
  std::string text;
  for (const Doubt& doubt : doubts) text += (text.empty() ? " | WARNING: " : "; ") + doubt.what;
  return text;
}

void printWarnings(const Doubts& doubts) {
  for (const Doubt& doubt : doubts) {
    std::fprintf(stderr, "warning: %s\n", sentenceOf(doubt).c_str());
  }
}

nlohmann::ordered_json toJson(const Doubts& doubts) {
  auto list = nlohmann::ordered_json::array();
  for (const Doubt& doubt : doubts) list.push_back(sentenceOf(doubt));
  return list;
}

}  // namespace perdure::tools
