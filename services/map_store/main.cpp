// perdure-map-store: the durable map of objects on the bus.
#include <chrono>
#include <optional>
#include <string>

#include "common/bus/topics.h"
#include "common/service/service.h"
#include "services/map_store/fleet/replicator.h"
#include "services/map_store/fleet/server_url.h"
#include "services/map_store/node.h"

namespace {

using namespace perdure;

/// Sends each commit to the fleet's server if `store.url` is set, and reports failures to log and
/// Health.
class FleetServer {
 public:
  explicit FleetServer(const map_store::Config& config) {
    if (!config.fleet.url.empty()) replicator_.emplace(config.fleet, config.store_path);
  }
  void onCommit(map_store::Node& node) {
    if (!replicator_) return;
    replicator_->wake();
    node.onAcknowledged(replicator_->progress().sent);
  }
  void count(ReasonCounts& counts) const {
    if (!replicator_) return;
    const auto progress = replicator_->progress();
    for (const auto& [code, count] : progress.reasons.all()) counts.add(code, count);
  }
  /// Returns the failure as a sentence with the fix; empty if there is none. Logs each kind of
  /// failure once when it begins, and when sending succeeds again.
  std::string tell(spdlog::logger& log) {
    if (!replicator_) return {};
    const auto progress = replicator_->progress();
    if (notice_ != progress.notice && !progress.notice.empty()) log.warn(progress.notice);
    if (failing_ != progress.failing && !progress.failing.empty()) log.warn(progress.trouble);
    if (!failing_.empty() && progress.failing.empty()) {
      log.info("The fleet's server takes the map again.");
    }
    notice_ = progress.notice;
    failing_ = progress.failing;
    return progress.trouble;
  }
  /// Sends the last commit if the server accepts it within 0.3 s; otherwise it is sent after the
  /// next start.
  void finish() {
    if (!replicator_) return;
    constexpr std::chrono::milliseconds kLastWords{300};
    replicator_->wake();
    (void)replicator_->finish(kLastWords);
  }

 private:
  std::optional<map_store::fleet::Replicator> replicator_;
  std::string notice_, failing_;
};

void serve(service::Context& context, const map_store::Config& config) {
  auto& tiles = context.writer(bus::kTopic<MapTile>);
  map_store::Node node(config, context.instance(),
                       {.tile = [&](const MapTile& tile) { (void)tiles.write(tile); },
                        .emptied = [&](const MapTile& key) { (void)tiles.dispose(key); },
                        .header = context.sink(bus::kTopic<MapHeader>),
                        .reply = context.sink(bus::kTopic<MapReply>),
                        .near = context.sink(bus::kTopic<MapNear>),
                        .frame = context.sink(bus::kTopic<MapFrame>),
                        .event = context.sink(bus::kTopic<Event>)});
  context.on(bus::kTopic<Calibration>, [&](const Calibration& m) { node.onCalibration(m); });
  context.on(bus::kTopic<Odometry>, [&](const Odometry& odometry) { node.onOdometry(odometry); });
  context.on(bus::kTopic<Landmarks>, [&](const Landmarks& seen) { node.onLandmarks(seen); });
  auto& heard =
      context.needs("objects", "semantic_filter's Health says why, or start semantic_filter");
  context.on(bus::kTopic<Objects>, [&](const Objects& objects) {
    heard.heard();
    context.health().frameIn();
    node.onObjects(objects);
  });
  context.on(bus::kTopic<MapQuery>, [&](const MapQuery& query) { node.onQuery(query); });
  context.on(bus::kTopic<MapCorrection>, [&](const MapCorrection& m) { node.onCorrection(m); });
  FleetServer server(config);
  context.every(std::chrono::milliseconds(50), [&, commits = std::uint64_t{0}]() mutable {
    node.tick(std::chrono::steady_clock::now().time_since_epoch());
    if (commits < node.commits()) server.onCommit(node);
    for (; commits < node.commits(); ++commits) context.health().frameOut();
  });
  context.countReasons([&]() -> const ReasonCounts& { return node.reasons(); });
  context.countReasons([&](ReasonCounts& counts) { server.count(counts); });
  context.onHealth([&] {
    const std::string unsent = server.tell(context.log());
    const std::string trouble = node.trouble().empty() ? unsent : node.trouble();
    context.health().state(trouble.empty() ? HealthState::kOk : HealthState::kDegraded, trouble);
  });
  if (!node.trouble().empty()) context.log().warn(node.trouble());
  context.run();
  node.flush();
  server.finish();
}

}  // namespace

int main(int argc, char** argv) {
  map_store::Config config;
  return service::runService(
      argc, argv,
      {.process = "map_store",
       .summary = "Keeps the map of objects: durable, published in tiles, open to questions",
       .describe = [&](config::Fields& fields) { map_store::describe(config, fields); },
       .body = [&](service::Context& context) { serve(context, config); },
       .verify = [&] { map_store::fleet::check(config.fleet); }});
}
