// perdure-gateway: publishes the data of the bus for browsers, Foxglove and Prometheus.
#include <algorithm>
#include <chrono>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "common/base/errors.h"
#include "common/base/files/access.h"
#include "common/bus/discovery.h"
#include "common/bus/topics.h"
#include "common/service/on_demand.h"
#include "common/wire/cdr.h"
#include "services/gateway/mcp/worker.h"
#include "services/gateway/node.h"
#include "services/gateway/web/server.h"

namespace {

using namespace perdure;
using service::monotonicNs;
namespace web = gateway::web;

/// Topics of @final types, which CDR readers decode by their IDL.
constexpr const char* kRawTopics[] = {"imu", "speed", "odometry", "landmarks"};

/// Requests from the server's thread to the service's loop.
struct Mail {
  std::mutex mutex;
  std::vector<gateway::Channels> wanted;  ///< all changes, not only the last, because a client that
                                          ///< reconnects must receive the current state again
  std::vector<gateway::Call> calls;
  std::vector<gateway::mcp::Question> questions;
};

std::vector<gateway::Figure> figuresOf(const web::Stats& stats,
                                       const std::optional<std::size_t>& objects) {
  const auto number = [](auto n) { return static_cast<double>(n); };
  std::vector<gateway::Figure> figures = {
      {"clients", "WebSocket clients now", false, number(stats.clients)},
      {"connections", "connections now", false, number(stats.connections)},
      {"sent_bytes_total", "bytes sent", true, number(stats.bytes_sent)},
      {"sent_messages_total", "WebSocket messages sent", true, number(stats.messages_sent)},
      {"encoded_total", "messages of channels made, once for all clients", true,
       number(stats.published)},
      {"lost_total", "messages that slow clients lost", true, number(stats.dropped)},
      {"requests_total", "HTTP requests", true, number(stats.requests)}};
  if (objects)
    figures.push_back(
        {"objects", "objects in the working set; while somebody looks", false, number(*objects)});
  return figures;
}

void listenAlways(service::Context& context, gateway::Node& node) {
  context.onCalibration([&](const Calibration& m) { node.onCalibration(m); });
  context.on(bus::kTopic<ModelInfo>, [&](const ModelInfo& m) { node.onModel(m); });
  context.on(bus::kTopic<Event>, [&](const Event& m) { node.onEvent(m); });
  context.on(bus::kTopic<Health>, [&](const Health& m) { node.onHealth(m, monotonicNs()); });
  context.on(bus::kTopic<MapFrame>, [&](const MapFrame& m) { node.onMapFrame(m); });
  context.on(bus::kTopic<MapReply>, [&](const MapReply& m) { node.onMapReply(m); });
}

/// Waits for stored messages, for at most 0.4 s, before the node sends its state to the first
/// viewer.
class Beginning {
 public:
  explicit Beginning(gateway::Node& node) : node_(node) {}
  void setWanted(const gateway::Channels& wanted, std::int64_t now_ns) {
    constexpr std::int64_t kPatience = 400'000'000;
    const bool begins = !looked_at_ && !wanted.empty();
    looked_at_ = !wanted.empty();
    if (begins) until_ns_ = now_ns + kPatience;
    if (!looked_at_) awaited_.reset(), later_.clear();
    if (begins || awaited_) {
      awaited_ = wanted;
    } else {
      node_.setWanted(wanted);
    }
  }
  void heard() {
    if (const auto wanted = std::exchange(awaited_, std::nullopt)) node_.setWanted(*wanted);
    for (const auto& work : std::exchange(later_, {})) work();
  }
  /// Runs `work` at once; during the wait, runs it after the node has received the viewers'
  /// channels.
  void afterwards(std::function<void()> work) {
    if (!awaited_) return work();
    later_.push_back(std::move(work));
  }
  void tick(std::int64_t now_ns) {
    if (now_ns >= until_ns_) heard();
  }
  bool lookedAt() const { return looked_at_; }

 private:
  gateway::Node& node_;
  bool looked_at_ = false;
  std::optional<gateway::Channels> awaited_;
  std::vector<std::function<void()>> later_;
  std::int64_t until_ns_ = 0;
};

class Readers {
 public:
  Readers(service::Context& context, gateway::Node& node, Beginning& beginning, web::Server& server,
          const gateway::Config& config)
      : context_(context), node_(node), beginning_(beginning) {
    listenToCameras(config);
    add(bus::kTopic<Landmarks>, {gateway::kLandmarks},
        [this](const Landmarks& m) { node_.onLandmarks(m); });
    add(
        bus::kTopic<MapTile>, {gateway::kMap, gateway::kMapScene},
        [this](const MapTile& m) { node_.onMapTile(m); },
        [this](const MapTile& key) { node_.onMapTileGone(key); });
    listenToObjects(config);
    listenToRaw(server);
  }
  /// Sets the channels that clients view, and opens or closes the readers.
  void follow(const gateway::Channels& wanted) {
    wanted_ = wanted;
    follow();
  }
  void follow() {
    for (service::OnDemand& reader : readers_) reader.follow();
  }

 private:
  service::OnDemand::Wanted any(gateway::Channels channels) const {
    return [this, channels = std::move(channels)] {
      return std::ranges::any_of(
          channels, [this](std::uint32_t channel) { return wanted_.contains(channel); });
    };
  }
  template <class T>
  void add(const bus::Topic<T>& topic, gateway::Channels channels,
           std::type_identity_t<Sink<T>> handler, std::type_identity_t<Sink<T>> on_gone = {}) {
    readers_.emplace_back(context_, topic, any(std::move(channels)), std::move(handler),
                          std::move(on_gone));
  }
  /// Reads the newest stored message (bus::Qos::kept) when one of the channels gets its first
  /// viewer. The reader is closed after the first message. Writers without a stored message send
  /// nothing.
  template <class T>
  void addNewestOfBefore(const bus::Topic<T>& topic, gateway::Channels channels,
                         std::type_identity_t<Sink<T>> handler) {
    const auto heard = std::make_shared<bool>(false);
    readers_.emplace_back(
        context_,
        [heard, viewed = any(std::move(channels))] {
          if (!viewed()) *heard = false;
          return viewed() && !*heard;
        },
        [this, topic, heard, handler = std::move(handler)] {
          auto reader =
              std::make_shared<bus::Reader<T>>(context_.participant(), topic, bus::ReadFrom::kKept);
          context_.loop().on(*reader, [this, heard, handler](const T& message) {
            if (!std::exchange(*heard, true)) handler(message);
            context_.loop().wake();  // a reader must not be closed while messages are delivered
          });
          return reader;
        });
  }
  void listenToCameras(const gateway::Config& config) {
    using namespace gateway;
    Channels for_detections{kDetections};
    for (std::size_t i = 0; i < config.cameras.size(); ++i) {
      for_detections.insert(cameraChannel(i, kAnnotations));
      for_detections.insert(cameraChannel(i, kLikelihood));
      const auto topic = bus::frameTopic(config.cameras[i]);
      add(topic, {cameraChannel(i, kImage)}, [this, i](const Frame& m) { node_.onFrame(i, m); });
      addNewestOfBefore(topic, {cameraChannel(i, kImage)}, [this, i](const Frame& m) {
        beginning_.afterwards([this, i, m] { node_.onFrameOfBefore(i, m); });
      });
    }
    add(bus::kTopic<Detections>, for_detections,
        [this](const Detections& m) { node_.onDetections(m); });
  }
  /// Reads objects and their related topics, which nearly all channels use.
  void listenToObjects(const gateway::Config& config) {
    gateway::Channels all;
    for (const auto& channel : gateway::channelTable(config.cameras)) all.insert(channel.id);
    addNewestOfBefore(bus::kTopic<Objects>, all, [this](const Objects& m) {
      node_.onObjectsOfBefore(m);
      beginning_.heard();
    });
    add(bus::kTopic<Odometry>, all,
        [this](const Odometry& m) { node_.onOdometry(m, monotonicNs()); });
    add(bus::kTopic<Objects>, all, [this](const Objects& m) {
      context_.health().frameIn();
      node_.onObjects(m, monotonicNs());
      context_.health().frameOut();
      beginning_.heard();
    });
  }
  void listenToRaw(web::Server& server) {
    std::uint32_t id = gateway::kRaw;
    for (const char* topic : kRawTopics) {
      readers_.emplace_back(context_, any({id}), [this, &server, topic, id] {
        auto reader = std::make_shared<bus::CdrReader>(context_.participant(), topic);
        context_.loop().on(*reader, [&server, id](const bus::CdrMessage& m) {
          server.publish({id, fromNanoseconds(m.written_ns),
                          std::make_shared<const std::string>(m.bytes.begin(), m.bytes.end())});
        });
        return reader;
      });
      ++id;
    }
  }

  service::Context& context_;
  gateway::Node& node_;
  Beginning& beginning_;
  gateway::Channels wanted_;
  std::list<service::OnDemand> readers_;
};

/// Returns the services that another program replaces (the bridge to ROS 2, or a driver), each with
/// a sentence.
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

/// Puts the truth of a simulated drive into the page.
void addTruth(const std::string& truth, const std::filesystem::path& folder, web::Files& files) {
  const std::string text = textOf(truth);
  if (text.empty()) {
    throw StartupError(ExitCode::kUnavailable, "page.truth: {} is empty or cannot be read", truth);
  }
  if (!nlohmann::json::accept(text)) {
    throw StartupError(ExitCode::kData, "page.truth: {} is not JSON; run the demo again", truth);
  }
  if (!files.empty() && !files.find("/truth.json")) {
    throw StartupError(ExitCode::kUnavailable,
                       "page.truth: the page in {} has no truth.json; build it again, or leave out "
                       "page.truth",
                       folder.string());
  }
  files.replaceIn("/truth.json", "null", text);
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
  web::Files files(folder);
  if (!config.cameras.empty()) {
    files.replaceIn("/foxglove_layout.json", "/camera/cam0/",
                    "/camera/" + config.cameras.front() + "/");
  }
  if (!config.page_truth.empty()) addTruth(config.page_truth, folder, files);
  return {"perdure", toHex(context.instance()), std::move(channels), gateway::serviceTable(),
          std::move(files)};
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
  content.ask = [&](std::uint64_t number, std::string message) {
    const std::lock_guard lock(mail.mutex);
    mail.questions.push_back({number, std::move(message)});
    context.loop().wake();
  };
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
  gateway::mcp::Worker worker(context.participant(), !config.web.token.empty(),
                              [&](std::uint64_t number, const gateway::mcp::Answer& answer) {
                                server.reply(number, answer.status, answer.text);
                              });
  auto& questions = context.writer(bus::kTopic<MapQuery>);
  auto& corrections = context.writer(bus::kTopic<MapCorrection>);
  gateway::Node node(config, vehicle, context.instance(),
                     {.message = [&](const gateway::Encoded& message) { server.publish(message); },
                      .time = [&](const TimePoint& time) { server.tellTime(time); },
                      .answer = [&](const gateway::Answer& answer) { server.answer(answer); },
                      .query = [&](const MapQuery& query) { (void)questions.write(query); },
                      .correction = [&](const MapCorrection& m) { (void)corrections.write(m); }});
  listenAlways(context, node);
  Beginning beginning(node);
  Readers readers(context, node, beginning, server, config);
  context.loop().onWake([&] {
    std::vector<gateway::Channels> changes;
    std::vector<gateway::Call> calls;
    std::vector<gateway::mcp::Question> asked;
    {
      const std::lock_guard lock(mail.mutex);
      changes.swap(mail.wanted);
      calls.swap(mail.calls);
      asked.swap(mail.questions);
    }
    for (gateway::mcp::Question& question : asked) worker.put(std::move(question));
    for (const gateway::Channels& wanted : changes) {
      beginning.setWanted(wanted, monotonicNs());
      readers.follow(wanted);
    }
    if (changes.empty()) readers.follow();
    for (const gateway::Call& call : calls) node.onCall(call, monotonicNs());
  });
  context.loop().every(
      std::chrono::milliseconds(100),
      [&] {
        beginning.tick(monotonicNs());
        node.tick(monotonicNs());
      },
      [&] { return beginning.lookedAt() || node.waits(); });
  context.countReasons([&]() -> const ReasonCounts& { return node.reasons(); });
  context.countReasons([&](ReasonCounts& counts) { counts.add(server.stats().reasons); });
  bus::Discovery discovery(context.participant());
  const std::string address = addressOf(config, server.port());
  context.onHealth([&] {
    const web::Stats stats = server.stats();
    context.health().state(HealthState::kOk,
                           "at " + address + " for " + std::to_string(stats.clients) + " clients");
    const std::int64_t now = monotonicNs();
    node.setStandIns(standIns(context.participant(), discovery, node.vitalSigns()));
    context.health().setDropped(stats.dropped);
    server.setTexts(
        node.vitalSigns().healthz(now),
        node.vitalSigns().metrics(
            now,
            figuresOf(stats, beginning.lookedAt() ? std::optional(node.objects()) : std::nullopt),
            stats.reasons.all()));
  });
  context.watch([&] { return server.goesOn(); });
  context.log().info("{} at {}", has_page ? "the page is" : "no page was built; Foxglove connects",
                     address);
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
