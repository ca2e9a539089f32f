// perdure-semantic-filter: publishes the belief about objects on the bus.
#include <chrono>
#include <deque>
#include <functional>

#include "common/base/heap.h"
#include "common/bus/once.h"
#include "common/bus/topics.h"
#include "common/service/service.h"
#include "services/semantic_filter/events.h"
#include "services/semantic_filter/node.h"
#include "services/semantic_filter/priors.h"

namespace {

using namespace perdure;

/// Delays messages until the map store has answered, because ids may be in use already.
class Gate {
 public:
  void pass(std::function<void()> message) {
    if (open_) return message();
    held_.push_back(std::move(message));
  }
  void open() {
    open_ = true;
    for (; !held_.empty(); held_.pop_front()) held_.front()();
  }
  bool isOpen() const { return open_; }

 private:
  bool open_ = false;
  std::deque<std::function<void()>> held_;
};

void askForRestore(service::Context& context, bus::Writer<MapQuery>& queries,
                   const semantic_filter::Config& config, Gate& gate) {
  context.every(std::chrono::milliseconds(100), [&, tries = 0]() mutable {
    if (gate.isOpen()) return;
    if (0.1 * tries++ > config.restore.timeout_s) {
      context.log().warn("no map store answered; beginning with an empty working set");
      return gate.open();
    }
    MapQuery query;
    query.client = context.instance();
    query.request = 1;
    query.kind = MapQueryKind::kRestore;
    (void)queries.write(query);
  });
}

void serve(service::Context& context, const semantic_filter::Config& config) {
  auto& states = context.writer(bus::kTopic<ObjectState>);
  auto& queries = context.writer(bus::kTopic<MapQuery>);
  semantic_filter::ObjectStates changed;
  const auto publish = [&, objects = context.sink(bus::kTopic<Objects>)](const Objects& m) {
    objects(m);
    context.health().frameOut();
    const auto changes = changed.update(m);
    for (const auto& state : changes.written) (void)states.write(state);
    for (const auto& state : changes.gone) (void)states.dispose(state);
  };
  semantic_filter::Node node(config, semantic_filter::loadPriors(config), context.instance(),
                             {.objects = publish,
                              .events = context.sink(bus::kTopic<Event>),
                              .predictions = context.sink(bus::kTopic<Predictions>)});
  Gate gate;
  ReasonCounts lost;
  bus::Gaps odometry_gaps;
  bus::Once odometry_once;  // the node counts repeated detections
  context.countReasons([&]() -> const ReasonCounts& { return node.reasons(); });
  context.countReasons([&]() -> const ReasonCounts& { return lost; });
  context.onCalibration([&](const Calibration& m) { node.onCalibration(m); });
  context.on(bus::kTopic<ModelInfo>, [&](const ModelInfo& m) { node.onModel(m); });
  context.on(bus::kTopic<SwapNotice>, [&](const SwapNotice& m) { node.onSwap(m); });
  context.on(bus::kTopic<MapNear>, [&](const MapNear& m) {
    node.onNear(m);
    if (m.client == context.instance()) gate.open();
  });
  auto& odometry = context.needs("odometry", "vio's Health says why, or start vio");
  context.on(bus::kTopic<Odometry>, [&](const Odometry& m) {
    odometry.heard();
    if (!odometry_once.first(m.stamp.source, m.stamp.sequence)) {
      return lost.add("odometry_repeated");
    }
    const auto missed = odometry_gaps.before(m.stamp.source, m.stamp.sequence);
    if (missed > 0) lost.add("odometry_missed", missed);
    context.health().frameIn();
    gate.pass([&, m] { node.onOdometry(m); });
  });
  context.on(bus::kTopic<Landmarks>,
             [&](const Landmarks& m) { gate.pass([&, m] { node.onLandmarks(m); }); });
  context.on(bus::kTopic<Detections>,
             [&](const Detections& m) { gate.pass([&, m] { node.onDetections(m); }); });
  askForRestore(context, queries, config, gate);
  context.onHealth([&] {
    context.health().state(gate.isOpen() ? HealthState::kOk : HealthState::kStarting,
                           gate.isOpen() ? node.note() : "waits for the map store's working set");
  });
  context.run();
  node.flush();
}

}  // namespace

int main(int argc, char** argv) {
  keepFreedMemory();
  semantic_filter::Config config;
  return service::runService(
      argc, argv,
      {.process = "semantic_filter",
       .summary = "What stands where: beliefs about objects from detections, odometry, landmarks.",
       .describe = [&](config::Fields& fields) { semantic_filter::describe(config, fields); },
       .body = [&](service::Context& context) { serve(context, config); }});
}
