// perdure-inference: frames to detections.
#include "common/service/service.h"
#include "services/inference/worker.h"

namespace {

using namespace perdure;

void run(service::Context& context, const inference::Config& config) {
  inference::Node node(config, context.instance());  // first: frames must not pile up meanwhile
  context.log().info("network {} with {} classes, hash {}", node.model().name,
                     node.model().classes.size(), toHex(node.model().hash));
  const auto& ownership = config.ownership;
  const double lease_s = inference::leaseSeconds(ownership);
  const auto strength = static_cast<std::int32_t>(ownership.strength - (ownership.standby ? 1 : 0));
  auto& detections = context.writer(bus::topics::kDetections, {strength, lease_s});
  (void)context.writer(bus::topics::kModel).write(node.model());
  const auto& rivals = context.on(bus::topics::kDetections, [](const Detections&) {});
  inference::Worker worker(node, ownership, detections, rivals, context.health());

  context.on(bus::topics::frame(config.detection.camera),
             [&](const Frame& frame) { worker.offer(frame); });
  context.every(durationFromSeconds(lease_s / 5), [&] { worker.assertAlive(); });
  context.countReasons([&](ReasonCounts& counts) { worker.report(counts); });
  context.onHealth([&] {
    const bool in_form = worker.inForm();
    context.health().state(in_form ? HealthState::kOk : HealthState::kDegraded,
                           in_form
                               ? worker.lastProblem()
                               : "results came later than the lease: give it a core of its own, a "
                                 "smaller network, or a longer ownership.period_s");
  });
  context.run();
}

}  // namespace

int main(int argc, char** argv) {
  inference::Config config;
  return service::runService(
      argc, argv,
      {.process = "inference",
       .summary = "Looks at frames with a network and publishes evidence for classes in boxes.",
       .describe = [&](config::Fields& fields) { inference::describe(config, fields); },
       .body = [&](service::Context& context) { run(context, config); }});
}
