#include "tests/bench/vio_suite/starts.h"

#include <algorithm>
#include <memory>
#include <random>

#include "common/math/so3.h"
#include "common/replay/dataset.h"
#include "services/vio/node.h"

namespace perdure::bench {
namespace {

constexpr double kPatience = 5.0, kJudgedAfter = 3.0;  // s

struct Attempt {
  std::unique_ptr<vio::Node> node;
  std::vector<Odometry> outputs;
};

StartRow judge(const std::string& clip, const std::string& variant, double cut_s, TimePoint cut,
               const Attempt& attempt, const replay::PoseFile& truth) {
  StartRow row;
  row.clip = clip;
  row.variant = variant;
  row.cut_s = cut_s;
  for (const auto& [code, n] : attempt.node->reasons().all()) row.reset |= code == "reset" && n > 0;
  if (attempt.outputs.empty()) return row;
  const Odometry& first = attempt.outputs.front();
  row.moving_s = toSeconds(first.stamp.time - cut);
  std::vector<Odometry> judged;
  for (const Odometry& o : attempt.outputs) {
    if (o.stamp.time <= first.stamp.time + durationFromSeconds(kJudgedAfter)) judged.push_back(o);
  }
  const StartJudgement j = judgeStart(judged, truth);
  row.scale = j.scale;
  row.error_m = j.error_m;
  row.nees = j.nees;
  row.velocity_error = j.velocity_error;
  row.velocity_sigma = j.velocity_sigma;
  row.wrong = j.error_m > 0.1 * j.way_m + 0.05 && j.deviations > 3.0;
  return row;
}

}  // namespace

std::vector<StartRow> startsOf(const Clip& clip, const std::filesystem::path& folder,
                               const std::vector<Variant>& variants, int cuts) {
  replay::DatasetOptions open;
  open.path = folder;
  open.encoding = open.second_encoding = ImageEncoding::kMono8;
  const auto dataset = replay::Dataset::open(open);
  const replay::PoseFile truth = truthOf(folder, *dataset);
  const double rate = dataset->calibration().cameras[0].rate_hz;
  const double seconds = static_cast<double>(dataset->frameCount()) / std::max(rate, 1.0);
  std::mt19937 random(static_cast<unsigned>(seconds * 1000.0));
  std::uniform_real_distribution<double> place(3.0, seconds - kPatience - kJudgedAfter - 1.0);
  std::vector<StartRow> rows;
  for (int i = 0; i < cuts; ++i) {
    const double cut_s = place(random);
    const auto index = dataset->skip(durationFromSeconds(cut_s));
    if (!index) continue;
    const TimePoint cut = *dataset->frameTime(*index);
    std::vector<Attempt> attempts(variants.size());
    for (std::size_t v = 0; v < variants.size(); ++v) {
      auto& outputs = attempts[v].outputs;
      attempts[v].node =
          std::make_unique<vio::Node>(variants[v].config, 1,
                                      vio::Outputs{[&outputs](const Odometry& o) {
                                                     if (o.state != OdometryState::kInitialising)
                                                       outputs.push_back(o);
                                                   },
                                                   [](const Landmarks&) {}});
      attempts[v].node->onCalibration(dataset->calibration());
    }
    const auto finished = [&](TimePoint now) {
      return std::all_of(attempts.begin(), attempts.end(), [&](const Attempt& a) {
        return now > (a.outputs.empty()
                          ? cut + durationFromSeconds(kPatience)
                          : a.outputs.front().stamp.time + durationFromSeconds(kJudgedAfter + 0.1));
      });
    };
    while (const auto message = dataset->next()) {
      for (const Attempt& a : attempts) {
        if (const auto* imu = std::get_if<ImuSample>(&*message)) a.node->onImu(*imu);
        if (const auto* speed = std::get_if<SpeedSample>(&*message)) a.node->onSpeed(*speed);
        if (const auto* frame = std::get_if<Frame>(&*message)) a.node->onFrame(*frame);
      }
      const auto* frame = std::get_if<Frame>(&*message);
      if (frame && finished(frame->stamp.time)) break;
    }
    for (std::size_t v = 0; v < variants.size(); ++v) {
      rows.push_back(judge(clip.name, variants[v].name, cut_s, cut, attempts[v], truth));
    }
  }
  return rows;
}

}  // namespace perdure::bench
