// perdure-gateway: what is on the bus, for browsers, Foxglove and Prometheus.
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "common/bus/discovery.h"
#include "common/bus/topics.h"
#include "common/service/service.h"
#include "common/wire/cdr.h"
#include "services/gateway/node.h"
#include "services/gateway/web/server.h"

namespace {

using namespace perdure;
namespace topics = bus::topics;
namespace web = gateway::web;

std::int64_t monotonicNs() {
  return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
}

/// A reader that is there while somebody looks: nothing is sent to this host for nobody.
class OnDemand {
 public:
  OnDemand(service::Context& context, gateway::Channels channels)
      : context_(context), channels_(std::move(channels)) {}
  virtual ~OnDemand() = default;
  void follow(const gateway::Channels& wanted) {
    bool now = false;
    for (const std::uint32_t channel : channels_) now = now || wanted.contains(channel);
    if (now == open_) return;
    open_ = now;
    if (now) {
      open();
    } else {
      close();
    }
  }

 protected:
  virtual void open() = 0;
  virtual void close() = 0;
  service::Context& context_;

 private:
  const gateway::Channels channels_;
  bool open_ = false;
};

template <class T>
class ReaderOnDemand : public OnDemand {
 public:
  ReaderOnDemand(service::Context& context, bus::Topic<T> topic, gateway::Channels channels,
                 Sink<T> handler, Sink<T> on_gone = {})
      : OnDemand(context, std::move(channels)),
        topic_(std::move(topic)),
        handler_(std::move(handler)),
        on_gone_(std::move(on_gone)) {
    context.countReasons([this](ReasonCounts& counts) {
      for (const auto& [reason, n] : before_.all()) counts.add(reason, n);
      if (reader_) reader_->report(counts);
    });
  }

 private:
  void open() override {
    reader_ = std::make_unique<bus::Reader<T>>(context_.participant(), topic_);
    context_.loop().on(*reader_, handler_, on_gone_);
  }
  void close() override {
    reader_->report(before_);
    context_.loop().off(*reader_);
    reader_.reset();
  }

  const bus::Topic<T> topic_;
  const Sink<T> handler_, on_gone_;
  std::unique_ptr<bus::Reader<T>> reader_;
  ReasonCounts before_;
};

/// The same of a topic's bytes as they come.
class BytesOnDemand : public OnDemand {
 public:
  using Handler = std::function<void(const bus::CdrMessage&)>;
  BytesOnDemand(service::Context& context, std::string topic, gateway::Channels channels,
                Handler handler)
      : OnDemand(context, std::move(channels)),
        topic_(std::move(topic)),
        handler_(std::move(handler)) {}

 private:
  void open() override {
    reader_ = std::make_unique<bus::CdrReader>(context_.participant(), topic_);
    context_.loop().on(*reader_, handler_);
  }
  void close() override {
    context_.loop().off(*reader_);
    reader_.reset();
  }

  const std::string topic_;
  const Handler handler_;
  std::unique_ptr<bus::CdrReader> reader_;
};

/// What is heard even while nobody looks, for who comes late: then seldom and, of what is told
/// whole each time, the newest alone. It is one reader all along: nothing is lost where somebody
/// begins to look.
template <class T>
class Overheard : public OnDemand {
 public:
  enum class Which { kAll, kNewest };

  Overheard(service::Context& context, const bus::Topic<T>& topic, Which which,
            gateway::Channels channels, Sink<T> handler)
      : OnDemand(context, std::move(channels)),
        which_(which),
        handler_(std::move(handler)),
        reader_(context.participant(), topic.name) {
    context.countReasons([this](ReasonCounts& counts) {
      reader_.report(counts);
      for (const auto& [reason, n] : malformed_.all()) counts.add(reason, n);
    });
  }
  /// What has come while nobody looks.
  void hear() {
    if (!looked_at_) take(which_);
  }

 private:
  void take(Which which) {
    std::vector<std::uint8_t> newest;
    while (reader_.drainBatch([&](const bus::CdrMessage& message) {
      if (which == Which::kAll) return hand(message.bytes);
      newest.assign(message.bytes.begin(), message.bytes.end());
    })) {
    }
    if (!newest.empty()) hand(newest);
  }
  void hand(std::span<const std::uint8_t> bytes) {
    const auto value = wire::decodeCdr<T>(bytes, nullptr);
    if (value) return handler_(*value);
    malformed_.add(reader_.topic() + "_malformed_" + value.error().code);
  }
  void open() override {
    looked_at_ = true;
    take(which_);
    context_.loop().on(reader_, [this](const bus::CdrMessage& m) { hand(m.bytes); });
  }
  void close() override {
    context_.loop().off(reader_);
    looked_at_ = false;
  }

  const Which which_;
  const Sink<T> handler_;
  bus::CdrReader reader_;
  bool looked_at_ = false;
  ReasonCounts malformed_;
};

/// Topics of @final types, which readers of CDR decode by their IDL.
constexpr const char* kRawTopics[] = {"imu", "speed", "odometry", "landmarks"};

/// What the server's thread tells the loop's.
struct Mail {
  std::mutex mutex;
  std::vector<gateway::Channels> wanted;  ///< each: who leaves and comes again is told anew
  std::vector<gateway::Call> calls;
};

std::vector<gateway::Figure> figuresOf(const web::Stats& stats, std::size_t objects) {
  const auto number = [](auto n) { return static_cast<double>(n); };
  return {{"clients", "WebSocket clients now", false, number(stats.clients)},
          {"connections", "connections now", false, number(stats.connections)},
          {"objects", "objects in the working set", false, number(objects)},
          {"sent_bytes_total", "bytes sent", true, number(stats.bytes_sent)},
          {"sent_messages_total", "WebSocket messages sent", true, number(stats.messages_sent)},
          {"encoded_total", "messages of channels made, once for all clients", true,
           number(stats.published)},
          {"lost_total", "messages that slow clients lost", true, number(stats.dropped)},
          {"requests_total", "HTTP requests", true, number(stats.requests)}};
}

void listenAlways(service::Context& context, gateway::Node& node) {
  context.on(topics::kCalibration, [&](const Calibration& m) { node.onCalibration(m); });
  context.on(topics::kModel, [&](const ModelInfo& m) { node.onModel(m); });
  context.on(topics::kEvents, [&](const Event& m) { node.onEvent(m); });
  context.on(topics::kHealth, [&](const Health& m) { node.onHealth(m, monotonicNs()); });
  context.on(topics::kMapFrame, [&](const MapFrame& m) { node.onMapFrame(m); });
  context.on(topics::kMapReply, [&](const MapReply& m) { node.onMapReply(m); });
}

/// Objects and odometry: for histories, the way so far, and where events were.
void overhear(service::Context& context, gateway::Node& node, const gateway::Config& config,
              std::vector<std::unique_ptr<OnDemand>>& readers) {
  gateway::Channels all;
  for (const auto& channel : gateway::channelTable(config.cameras)) all.insert(channel.id);
  auto odometry = std::make_unique<Overheard<Odometry>>(
      context, topics::kOdometry, Overheard<Odometry>::Which::kAll, all,
      [&](const Odometry& m) { node.onOdometry(m, monotonicNs()); });
  auto objects = std::make_unique<Overheard<Objects>>(
      context, topics::kObjects, Overheard<Objects>::Which::kNewest, all, [&](const Objects& m) {
        context.health().frameIn();
        node.onObjects(m, monotonicNs());
        context.health().frameOut();
      });
  // As often as the history of an object is sampled.
  context.every(std::chrono::milliseconds(500),
                [odometry = odometry.get(), objects = objects.get()] {
                  odometry->hear();
                  objects->hear();
                });
  readers.push_back(std::move(odometry));
  readers.push_back(std::move(objects));
}

std::vector<std::unique_ptr<OnDemand>> listenOnDemand(service::Context& context,
                                                      gateway::Node& node,
                                                      const gateway::Config& config) {
  using namespace gateway;
  std::vector<std::unique_ptr<OnDemand>> readers;
  Channels for_detections{kDetections};
  for (std::size_t i = 0; i < config.cameras.size(); ++i) {
    for_detections.insert(cameraChannel(i, kAnnotations));
    for_detections.insert(cameraChannel(i, kLikelihood));
    readers.push_back(std::make_unique<ReaderOnDemand<Frame>>(
        context, topics::frame(config.cameras[i]), Channels{cameraChannel(i, kImage)},
        [&node, i](const Frame& m) { node.onFrame(i, m); }));
  }
  readers.push_back(std::make_unique<ReaderOnDemand<Detections>>(
      context, topics::kDetections, for_detections,
      [&](const Detections& m) { node.onDetections(m); }));
  readers.push_back(std::make_unique<ReaderOnDemand<Landmarks>>(
      context, topics::kLandmarks, Channels{kLandmarks},
      [&](const Landmarks& m) { node.onLandmarks(m); }));
  readers.push_back(std::make_unique<ReaderOnDemand<MapTile>>(
      context, topics::kMap, Channels{kMap, kMapScene},
      [&](const MapTile& m) { node.onMapTile(m); },
      [&](const MapTile& key) { node.onMapTileGone(key); }));
  return readers;
}

void listenToRaw(service::Context& context, web::Server& server,
                 std::vector<std::unique_ptr<OnDemand>>& readers) {
  std::uint32_t id = gateway::kRaw;
  for (const char* topic : kRawTopics) {
    readers.push_back(std::make_unique<BytesOnDemand>(
        context, topic, gateway::Channels{id}, [&server, id](const bus::CdrMessage& m) {
          server.publish({id, fromNanoseconds(m.written_ns),
                          std::make_shared<const std::string>(m.bytes.begin(), m.bytes.end())});
        }));
    ++id;
  }
}

/// Services that others stand in for: the bridge to ROS 2, a driver of one's own.
std::map<std::string, std::string> standIns(const bus::Participant& participant,
                                            bus::Discovery& discovery,
                                            const gateway::VitalSigns& heard) {
  std::map<std::string, std::string> sentences;
  std::vector<bus::RemoteEndpoint> endpoints;
  for (const char* service : {"capture", "vio", "inference"}) {
    if (heard.hears(service, monotonicNs())) continue;
    if (endpoints.empty()) endpoints = discovery.endpoints();
    if (const auto other = bus::standInFor(service, endpoints, participant.wireName(""))) {
      sentences[service] = other->process + " stands in for it: it writes " + other->topic;
    }
  }
  return sentences;
}

web::Content contentFor(const service::Context& context, const gateway::Config& config) {
  const auto folder = config.page_folder.empty() ? web::usualPageFolder()
                                                 : std::filesystem::path(config.page_folder);
  auto channels = gateway::channelTable(config.cameras);
  std::uint32_t id = gateway::kRaw;
  for (const char* topic : kRawTopics) {
    const std::string type = bus::findTopic(topic)->typeName();
    channels.push_back(gateway::rawChannel(id++, topic, type, wire::idlOf(type)));
  }
  return {"perdure", toHex(context.instance()), std::move(channels), gateway::serviceTable(),
          web::Files(folder)};
}

std::string addressOf(const gateway::Config& config, std::uint16_t port) {
  const std::string& address = config.web.address;
  const bool six = address.find(':') != std::string::npos;
  return "http://" + (six ? "[" + address + "]" : address) + ":" + std::to_string(port) + "/";
}

void serve(service::Context& context, const gateway::Config& config, const std::string& vehicle) {
  Mail mail;
  web::Content content = contentFor(context, config);
  const bool has_page = !content.files.empty();
  web::Server server(config.web, std::move(content),
                     {.wanted =
                          [&](const gateway::Channels& wanted) {
                            const std::lock_guard lock(mail.mutex);
                            mail.wanted.push_back(wanted);
                            context.loop().wake();
                          },
                      .call =
                          [&](gateway::Call call) {
                            const std::lock_guard lock(mail.mutex);
                            mail.calls.push_back(std::move(call));
                            context.loop().wake();
                          }});
  auto& questions = context.writer(topics::kMapQuery);
  gateway::Node node(config, vehicle, context.instance(),
                     {.message = [&](const gateway::Encoded& message) { server.publish(message); },
                      .time = [&](const TimePoint& time) { server.tellTime(time); },
                      .answer = [&](const gateway::Answer& answer) { server.answer(answer); },
                      .query = [&](const MapQuery& query) { (void)questions.write(query); }});
  listenAlways(context, node);
  auto readers = listenOnDemand(context, node, config);
  overhear(context, node, config, readers);
  listenToRaw(context, server, readers);
  context.loop().onWake([&] {
    std::vector<gateway::Channels> changes;
    std::vector<gateway::Call> calls;
    {
      const std::lock_guard lock(mail.mutex);
      changes.swap(mail.wanted);
      calls.swap(mail.calls);
    }
    for (const gateway::Channels& wanted : changes) {
      node.setWanted(wanted);
      for (const auto& reader : readers) reader->follow(wanted);
    }
    for (const gateway::Call& call : calls) node.onCall(call, monotonicNs());
  });
  context.every(std::chrono::milliseconds(100), [&] { node.tick(monotonicNs()); });
  context.countReasons([&]() -> const ReasonCounts& { return node.reasons(); });
  context.countReasons([&](ReasonCounts& counts) {
    const web::Stats stats = server.stats();
    for (const auto& [reason, n] : stats.reasons.all()) counts.add(reason, n);
  });
  bus::Discovery discovery(context.participant());
  context.onHealth([&] {
    const web::Stats stats = server.stats();
    const std::int64_t now = monotonicNs();
    node.setStandIns(standIns(context.participant(), discovery, node.vitalSigns()));
    context.health().setDropped(stats.dropped);
    server.setTexts(
        node.vitalSigns().healthz(now),
        node.vitalSigns().metrics(now, figuresOf(stats, node.objects()), stats.reasons.all()));
  });
  context.watch([&] { return server.goesOn(); });
  context.log().info("{} at {}", has_page ? "the page is" : "no page was built; Foxglove connects",
                     addressOf(config, server.port()));
  context.run();
}

}  // namespace

int main(int argc, char** argv) {
  gateway::Config config;
  return service::runService(
      argc, argv,
      {.process = "gateway",
       .summary = "Shows what is on the bus: a page, Foxglove's WebSocket protocol, metrics",
       .describe = [&](config::Fields& fields) { gateway::describe(config, fields); },
       .body = [&](service::Context& context) { serve(context, config, context.vehicle()); },
       .verify = [&] { gateway::verify(config); },
       .shorthands = {{"--port", "http.port", "PORT"}}});
}
