// perdure-vio: where the body is, from camera, IMU and speed.
#include <chrono>
#include <opencv2/core/utility.hpp>

#include "common/bus/gaps.h"
#include "common/bus/topics.h"
#include "common/service/service.h"
#include "common/vision/jpeg.h"
#include "services/vio/node.h"
#include "services/vio/state_file.h"

namespace {

using namespace perdure;
namespace topics = bus::topics;

void serve(service::Context& context, const vio::Config& config) {
  cv::setNumThreads(1);  // images of this size are not worth the threads
  const vio::StateFile file(config.state_directory);
  const auto odometry = context.sink(topics::kOdometry);
  vio::Node node(config, context.instance(),
                 {.odometry =
                      [&](const Odometry& m) {
                        odometry(m);
                        context.health().frameOut();
                      },
                  .landmarks = context.sink(topics::kLandmarks)});
  ReasonCounts own;
  if (const auto text = file.read()) {
    if (const auto restored = node.restoreState(*text); !restored) {
      context.log().warn("the saved state is left aside: {}", restored.error().detail);
      own.add(restored.error());
    }
  }
  context.countReasons([&]() -> const ReasonCounts& { return node.reasons(); });
  context.countReasons([&]() -> const ReasonCounts& { return own; });
  context.on(topics::kCalibration, [&](const Calibration& m) { node.onCalibration(m); });
  auto& samples = context.needs("inertial samples", "mend the IMU, or start capture");
  context.on(topics::kImu, [&](const ImuSample& m) {
    samples.heard();
    node.onImu(m);
  });
  context.on(topics::kSpeed, [&](const SpeedSample& m) { node.onSpeed(m); });
  if (config.moving_mask.enabled) {
    context.on(topics::kObjects, [&](const Objects& m) { node.onObjects(m); });
  }
  auto& frames = context.needs("frames", "mend the camera, or start capture");
  std::vector<bus::Once> once(config.cameras.size());
  std::vector<bus::Gaps> gaps(config.cameras.size());
  for (std::size_t i = 0; i < config.cameras.size(); ++i) {
    context.on(topics::frame(config.cameras[i]), [&, i](const Frame& m) {
      if (!once[i].first(m.stamp.source, m.stamp.sequence)) return own.add("frames_repeated");
      const auto missed = gaps[i].before(m.stamp.source, m.stamp.sequence);
      if (missed > 0) own.add("frames_missed", missed);
      if (i == 0) {
        frames.heard();
        context.health().frameIn();
      }
      if (const auto pixels = vision::decompressed(m, ImageEncoding::kMono8)) {
        node.onFrame(*pixels);
      } else {
        own.add(pixels.error());
      }
    });
  }
  context.every(std::chrono::seconds(1), [&] {
    if (const auto kept = file.write(node.saveState()); !kept) own.add(kept.error());
  });
  context.onHealth([&] { context.health().state(node.health(), node.status()); });
  context.run();
}

}  // namespace

int main(int argc, char** argv) {
  vio::Config config;
  return service::runService(
      argc, argv,
      {.process = "vio",
       .summary = "Where the body is: odometry and sparse points from camera, IMU and speed.",
       .describe = [&](config::Fields& fields) { vio::describe(config, fields); },
       .body = [&](service::Context& context) { serve(context, config); }});
}
