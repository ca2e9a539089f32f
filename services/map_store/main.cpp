// perdure-map-store: the durable map of objects on the bus.
#include <chrono>

#include "common/bus/topics.h"
#include "common/service/service.h"
#include "services/map_store/node.h"

namespace {

using namespace perdure;
namespace topics = bus::topics;

void serve(service::Context& context, const map_store::Config& config) {
  auto& tiles = context.writer(topics::kMap);
  map_store::Node node(config, context.instance(),
                       {.tile = [&](const MapTile& tile) { (void)tiles.write(tile); },
                        .emptied = [&](const MapTile& key) { (void)tiles.dispose(key); },
                        .header = context.sink(topics::kMapHeader),
                        .reply = context.sink(topics::kMapReply),
                        .recalled = context.sink(topics::kRecalled),
                        .frame = context.sink(topics::kMapFrame),
                        .event = context.sink(topics::kEvents)});
  context.on(topics::kOdometry, [&](const Odometry& odometry) { node.onOdometry(odometry); });
  context.on(topics::kEvents, [&](const Event& event) { node.onEvent(event); });
  auto& heard =
      context.needs("objects", "semantic_filter's Health says why, or start semantic_filter");
  context.on(topics::kObjects, [&](const Objects& objects) {
    heard.heard();
    context.health().frameIn();
    node.onObjects(objects);
  });
  context.on(topics::kMapQuery, [&](const MapQuery& query) { node.onQuery(query); });
  context.every(std::chrono::milliseconds(50), [&, commits = std::uint64_t{0}]() mutable {
    node.tick(std::chrono::steady_clock::now().time_since_epoch());
    for (; commits < node.commits(); ++commits) context.health().frameOut();
  });
  context.countReasons([&]() -> const ReasonCounts& { return node.reasons(); });
  context.onHealth([&] {
    const std::string trouble = node.trouble();
    context.health().state(trouble.empty() ? HealthState::kOk : HealthState::kDegraded, trouble);
  });
  if (!node.trouble().empty()) context.log().warn(node.trouble());
  context.run();
  node.flush();
}

}  // namespace

int main(int argc, char** argv) {
  map_store::Config config;
  return service::runService(
      argc, argv,
      {.process = "map_store",
       .summary = "Keeps the map of objects: durable, published in tiles, open to questions",
       .describe = [&](config::Fields& fields) { map_store::describe(config, fields); },
       .body = [&](service::Context& context) { serve(context, config); }});
}
