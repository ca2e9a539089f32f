// perdure-inference: computes detections from frames.
#include "common/bus/once.h"
#include "common/service/service.h"
#include "common/vision/jpeg.h"
#include "services/inference/worker.h"

namespace {

using namespace perdure;

void run(service::Context& context, const inference::Config& config) {
  inference::Node node(config, context.instance());  // before readers exist, so no frames queue
  context.log().info("network {} with {} classes, hash {}, by {}", node.model().name,
                     node.model().classes.size(), toHex(node.model().hash), node.backend());
  const auto& ownership = config.ownership;
  const double lease_s = inference::leaseSeconds(ownership);
  auto& detections = context.writer(bus::kTopic<Detections>,
                                    {inference::Worker::firstStrength(ownership), lease_s});
  auto& notices = context.writer(bus::kTopic<SwapNotice>);
  auto& models = context.writer(bus::kTopic<ModelInfo>);
  inference::Worker* worker = nullptr;  // set below, before context.run() calls handlers
  const auto& rivals =
      context.on(bus::kTopic<Detections>, [&](const Detections& heard) { worker->heard(heard); });
  inference::Worker the_worker(node, ownership, config.model.budget_ms,
                               {detections, rivals, models, notices}, context.health(),
                               [&] { context.stop(); });
  worker = &the_worker;

  ReasonCounts lost;
  bus::Gaps gaps;
  context.on(bus::kTopic<ModelInfo>, [&](const ModelInfo& model) { worker->learn(model); });
  context.on(bus::kTopic<SwapNotice>, [&](const SwapNotice& notice) { worker->told(notice); });
  auto& frames = context.needs("frames", "fix the camera, or start capture");
  context.on(bus::frameTopic(config.detection.camera), [&](const Frame& frame) {
    frames.heard();
    const auto missed = gaps.before(frame.stamp.source, frame.stamp.sequence);
    if (missed > 0) lost.add("frames_missed", missed);
    if (const auto pixels = vision::decompressed(frame)) {
      worker->offer(*pixels);
    } else {
      lost.add(pixels.error());
    }
  });
  context.countReasons([&]() -> const ReasonCounts& { return lost; });
  context.on(bus::kTopic<Calibration>, [&](const Calibration& m) { worker->onCalibration(m); });
  context.on(bus::kTopic<Odometry>, [&](const Odometry& m) { worker->onOdometry(m); });
  context.on(bus::kTopic<Predictions>, [&](const Predictions& m) { worker->expect(m); });
  context.every(durationFromSeconds(lease_s / 5), [&] { worker->assertAlive(); });
  constexpr std::chrono::seconds kHangs{10};  // longer than any network needs for a frame
  context.watch([&] { return worker->goesOn(kHangs); });
  context.countReasons([&](ReasonCounts& counts) { worker->report(counts); });
  context.onHealth([&] {
    const auto [state, message] = worker->state();
    context.health().state(state, message);
  });
  context.run();
  detections.waitForAcknowledgement(0.2);
  notices.waitForAcknowledgement(0.2);
  if (const std::string why = worker->failure(); !why.empty()) throw std::runtime_error(why);
}

}  // namespace

int main(int argc, char** argv) {
  inference::Config config;
  return service::runService(
      argc, argv,
      {.process = "inference",
       .summary = "Looks at frames with a network and publishes evidence for classes in boxes.",
       .describe = [&](config::Fields& fields) { inference::describe(config, fields); },
       .body = [&](service::Context& context) { run(context, config); },
       .shorthands = {{"--budget-ms", "model.budget_ms", "MS"}}});
}
