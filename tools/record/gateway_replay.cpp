#include "tools/record/gateway_replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/base/errors.h"
#include "services/gateway/core/beliefs.h"

namespace perdure::tools {
namespace {

using namespace std::chrono_literals;
constexpr double kBack = 3.0;  // s; a seek reads the recording from this time before its target

bool isShown(const std::string& topic) {
  return topic.starts_with("calibration") || topic == "odometry" || topic == "landmarks" ||
         topic == "detections" || topic == "model" || topic == "objects" || topic == "events" ||
         topic == "map/frame" || topic == "map/reply" || topic == "health" ||
         topic.starts_with("frame/");
}

std::optional<TimePoint> sensorTimeOf(const replay::RecordedMessage& message) {
  if (message.topic == "odometry") {
    const auto odometry = replay::valueOf<Odometry>(message);
    if (odometry) return odometry->stamp.time;
  } else if (message.topic == "objects") {
    const auto objects = replay::valueOf<Objects>(message);
    if (objects) return objects->stamp.time;
  }
  return std::nullopt;
}

bool looksAtGraph(const gateway::Channels& wanted) {
  return wanted.contains(gateway::kMapGraph) || wanted.contains(gateway::kMapGraphScene) ||
         wanted.contains(gateway::kMapSeen);
}

/// The channel that shows every message of a topic; empty for other topics.
std::optional<std::uint32_t> channelOf(const std::string& topic,
                                       const std::vector<std::string>& cameras) {
  if (topic == "landmarks") return gateway::kLandmarks;
  if (topic == "detections") return gateway::kDetections;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (topic == "frame/" + cameras[i]) return gateway::cameraChannel(i, gateway::kImage);
  }
  return std::nullopt;
}

bool isTimed(const std::string& topic) { return topic == "odometry" || topic == "objects"; }

}  // namespace

GatewayReplay::GatewayReplay(replay::RecordedMessages& recording, const gateway::Config& config,
                             const gateway::PlaybackRequest& start, double start_s)
    : recording_(recording), config_(config), playing_(start.play), speed_(start.speed) {
  measure();
  refuseAfterTheEnd(start_s);
  const auto folder = config.page_folder.empty() ? gateway::web::usualPageFolder()
                                                 : std::filesystem::path(config.page_folder);
  auto services = gateway::serviceTable();
  services.push_back(gateway::nextEventService());
  const auto post = [this](auto change) {
    const std::lock_guard lock(mutex_);
    change(mail_);
    something_.notify_one();
  };
  node_ = freshNode();
  server_ = std::make_unique<gateway::web::Server>(
      config.web,
      gateway::web::Content{"perdure play", toHex(makeInstanceId()),
                            gateway::channelTable(config.cameras), std::move(services),
                            gateway::web::Files(folder), range()},
      gateway::web::Hub::Told{
          .wanted =
              [post](const gateway::Channels& w) { post([&](Mail& m) { m.wanted.push_back(w); }); },
          .call =
              [post](gateway::Call c) { post([&](Mail& m) { m.calls.push_back(std::move(c)); }); },
          .playback =
              [post](gateway::PlaybackRequest r) {
                post([&](Mail& m) { m.requests.push_back(std::move(r)); });
              }});
  seek(logTime(first_.time + durationFromSeconds(start_s)));
}

GatewayReplay::~GatewayReplay() = default;

/// Finds the first and the last instant that have both sensor time and recorder time. Times between
/// them are interpolated linearly.
void GatewayReplay::measure() {
  begin_ns_ = recording_.startNs();
  end_ns_ = recording_.endNs();
  recording_.rewind(isTimed);
  std::optional<Instant> first;
  while (const auto message = first ? std::nullopt : recording_.next()) {
    if (const auto time = sensorTimeOf(*message)) first = {message->log_ns, *time};
  }
  if (!first) {
    throw StartupError(ExitCode::kUsage,
                       "the recording has neither odometry nor objects, so there is nothing to "
                       "show; `perdure record info` tells what it has");
  }
  first_ = last_ = *first;
  // A recording may continue long after its drive. So the search starts earlier and earlier until
  // it finds a message with sensor time.
  constexpr std::uint64_t kTail = 5'000'000'000, kGrows = 4;
  for (std::uint64_t tail = kTail; last_.time == first_.time; tail *= kGrows) {
    const bool all = end_ns_ - first_.log_ns <= tail;
    recording_.rewind(isTimed, all ? first_.log_ns : end_ns_ - tail);
    while (const auto message = recording_.next()) {
      const auto time = sensorTimeOf(*message);
      if (time && *time > last_.time) last_ = {message->log_ns, *time};
    }
    if (all) break;
  }
  begin_ns_ = first_.log_ns;
  end_ns_ = last_.log_ns;
}

void GatewayReplay::refuseAfterTheEnd(double start_s) const {
  const double all = toSeconds(last_.time - first_.time);
  if (start_s <= all) return;
  throw StartupError(ExitCode::kUsage, "--start {:g}: the recording has {:.1f} s", start_s, all);
}

TimePoint GatewayReplay::sensorTime(std::uint64_t log_ns) const {
  const double span = static_cast<double>(last_.log_ns - first_.log_ns);
  const double slope =
      span > 0 ? static_cast<double>((last_.time - first_.time).count()) / span : 1;
  const double since = static_cast<double>(static_cast<std::int64_t>(log_ns - first_.log_ns));
  return first_.time + Duration(static_cast<std::int64_t>(slope * since));
}

std::uint64_t GatewayReplay::logTime(TimePoint time) const {
  const auto all = static_cast<double>((last_.time - first_.time).count());
  const auto since = static_cast<double>((time - first_.time).count());
  const double share = all > 0 ? std::clamp(since / all, 0.0, 1.0) : 0.0;
  return first_.log_ns +
         static_cast<std::uint64_t>(share * static_cast<double>(last_.log_ns - first_.log_ns));
}

std::int64_t GatewayReplay::nowNs() const { return static_cast<std::int64_t>(at_ns_); }

std::unique_ptr<gateway::Node> GatewayReplay::freshNode() {
  const auto no_store = [this](const auto& query) {
    MapReply reply;
    reply.client = query.client;
    reply.request = query.request;
    reply.ok = false;
    reply.error = "a recording has no map store; perdure map --db FILE asks a map";
    refusals_.push_back(reply);  // queues the reply, because the node is making the request
  };
  return std::make_unique<gateway::Node>(
      config_, "recording", 1,
      gateway::Outputs{.message = [this](const gateway::Encoded& m) { server_->publish(m); },
                       .time = [this](const TimePoint& t) { server_->tellTime(t); },
                       .answer = [this](const gateway::Answer& a) { server_->answer(a); },
                       .query = no_store,
                       .correction = no_store});
}

/// Restores the state at a log time by reading the last seconds before it.
void GatewayReplay::seek(std::uint64_t log_ns) {
  node_ = freshNode();
  newest_.clear();
  recallRig(log_ns);
  recallGraph(log_ns);
  const auto back = static_cast<std::uint64_t>(1e9 * kBack);
  recording_.rewind(isShown, log_ns > back ? log_ns - back : 0);
  next_ = recording_.next();
  while (next_ && next_->log_ns < log_ns) (void)pull();
  node_->setWanted(wanted_);
  at_ns_ = log_ns;
  ended_ = false;
  setClock();
  if (!playing_) showFrame();
  repeatFrames({});
}

/// Restores the last calibration and model before a time; if there are none, uses the known ones.
void GatewayReplay::recallRig(std::uint64_t log_ns) {
  if (calibration_) node_->onCalibration(*calibration_);
  if (model_) node_->onModel(*model_);
  recording_.rewind(
      [](const std::string& t) { return t.starts_with("calibration") || t == "model"; });
  while (const auto message = recording_.next()) {
    if (message->log_ns > log_ns) break;
    feed(*message);
  }
}

/// Repeats messages on channels that are not in `before`: images of the same frame as the shown
/// objects, and the newest message of each other topic.
void GatewayReplay::repeatFrames(const gateway::Channels& before) {
  const auto shown = node_->shownTime();
  for (const auto& [topic, messages] : newest_) {
    const auto channel = channelOf(topic, config_.cameras);
    if (!channel || !wanted_.contains(*channel) || before.contains(*channel)) continue;
    const auto fits = std::find_if(messages.rbegin(), messages.rend(), [&](const auto& message) {
      const auto frame = replay::valueOf<Frame>(message);
      return frame && frame->stamp.time == shown;
    });
    feed(fits != messages.rend() ? *fits : messages.back());
  }
}

/// Finds the newest graph of the map before a log time; extends the search until one is found.
void GatewayReplay::recallGraph(std::uint64_t log_ns) {
  graph_.reset();
  if (!recording_.topics().contains("map/reply")) return;
  constexpr double kFirst = 15.0, kGrows = 4.0;
  for (double back = kFirst; !graph_; back *= kGrows) {
    const double since = static_cast<double>(log_ns - std::min(log_ns, recording_.startNs()));
    const bool all = 1e9 * back >= since;
    recording_.rewind([](const std::string& t) { return t == "map/reply" || t == "map/frame"; },
                      all ? 0 : log_ns - static_cast<std::uint64_t>(1e9 * back));
    while (const auto message = recording_.next()) {
      if (message->log_ns >= log_ns) break;
      feed(*message);
    }
    if (all) return;
  }
}

/// Advances to the next `objects` message, so that a paused replay shows objects.
void GatewayReplay::showFrame() {
  fed_objects_ = false;
  const gateway::Channels wanted = std::exchange(wanted_, {});
  while (next_ && !fed_objects_) (void)pull();
  wanted_ = wanted;
}

void GatewayReplay::seekToNextEvent(const gateway::Call& call) {
  replay::RecordedMessages& r = recording_;
  r.rewind([](const std::string& topic) { return topic == "events"; }, at_ns_);
  std::optional<Event> found;
  std::uint64_t place = 0;
  while (const auto message = r.next()) {
    if (message->log_ns <= at_ns_ + 50'000'000) continue;
    if (const auto event = replay::valueOf<Event>(*message)) {
      found = *event;
      place = message->log_ns;
      break;
    }
  }
  if (!found) {
    seek(at_ns_);
    server_->answer({call.client, call.service, call.call, false, "there is no later event"});
    return;
  }
  seek(place);
  server_->answer({call.client, call.service, call.call, true, gateway::eventJson(*found)});
  tellState(true, "");
}

/// Feeds one message to the gateway's node; returns false at the end of the recording.
bool GatewayReplay::pull() {
  if (!next_) return false;
  at_ns_ = std::max(at_ns_, next_->log_ns);
  feed(*next_);
  if (channelOf(next_->topic, config_.cameras)) {
    constexpr std::size_t kMost = 16;  // objects follow their image by some frames
    auto& newest = newest_[next_->topic];
    newest.push_back(std::move(*next_));
    if (newest.size() > kMost) newest.pop_front();
  }
  next_ = recording_.next();
  return true;
}

void GatewayReplay::feed(const replay::RecordedMessage& message) {
  const auto give = [&]<class T>(auto take) {
    if (const auto value = replay::valueOf<T>(message)) take(*value);
  };
  const std::string& topic = message.topic;
  if (topic == "objects") {
    give.operator()<Objects>([&](const Objects& m) { node_->onObjects(m, nowNs()); });
    fed_objects_ = true;
  } else if (topic == "odometry") {
    give.operator()<Odometry>([&](const Odometry& m) { node_->onOdometry(m, nowNs()); });
  } else if (topic == "landmarks" && wanted_.contains(gateway::kLandmarks)) {
    give.operator()<Landmarks>([&](const Landmarks& m) { node_->onLandmarks(m); });
  } else if (topic == "detections") {
    give.operator()<Detections>([&](const Detections& m) { node_->onDetections(m); });
  } else if (topic == "map/frame") {
    give.operator()<MapFrame>([&](const MapFrame& m) { node_->onMapFrame(m); });
  } else if (topic == "map/reply") {
    give.operator()<MapReply>([&](const MapReply& m) {
      if (!m.anchors.empty()) graph_ = m, node_->onMapGraph(m);
    });
  } else if (topic == "events") {
    give.operator()<Event>([&](const Event& m) { node_->onEvent(m); });
  } else if (topic == "health") {
    give.operator()<Health>([&](const Health& m) { node_->onHealth(m, nowNs()); });
  } else if (topic.starts_with("calibration")) {
    give.operator()<Calibration>(
        [&](const Calibration& m) { calibration_ = m, node_->onCalibration(m); });
  } else if (topic == "model") {
    give.operator()<ModelInfo>([&](const ModelInfo& m) { model_ = m, node_->onModel(m); });
  }
  for (std::size_t i = 0; i < config_.cameras.size(); ++i) {
    if (topic != "frame/" + config_.cameras[i]) continue;
    if (!wanted_.contains(gateway::cameraChannel(i, gateway::kImage))) continue;
    give.operator()<Frame>([&](const Frame& m) { node_->onFrame(i, m); });
  }
}

void GatewayReplay::setClock() {
  clock_log_ns_ = at_ns_;
  clock_began_ = Clock::now();
}

void GatewayReplay::tellState(bool did_seek, const std::string& id) {
  using Status = gateway::PlaybackState::Status;
  const Status status = ended_ ? Status::kEnded : playing_ ? Status::kPlaying : Status::kPaused;
  server_->tellPlayback({status, sensorTime(at_ns_), speed_, did_seek, id});
}

void GatewayReplay::obey(const gateway::PlaybackRequest& request) {
  playing_ = request.play;
  speed_ = request.speed;
  if (request.seek) {
    seek(logTime(*request.seek));
  } else if (ended_ && request.play) {
    seek(begin_ns_);
  }
  setClock();
  tellState(request.seek.has_value(), request.id);
}

GatewayReplay::Mail GatewayReplay::waitUntil(Clock::time_point due) {
  std::unique_lock lock(mutex_);
  something_.wait_until(lock, due, [&] { return !mail_.empty(); });
  return std::exchange(mail_, {});
}

void GatewayReplay::look(const gateway::Channels& wanted) {
  if (graph_ && looksAtGraph(wanted) && !looksAtGraph(wanted_)) node_->onMapGraph(*graph_);
  const gateway::Channels before = std::exchange(wanted_, wanted);
  node_->setWanted(wanted_);
  repeatFrames(before);
}

void GatewayReplay::handle(Mail mail) {
  stopped_ = stopped_ || mail.stop;
  for (const gateway::Channels& wanted : mail.wanted) look(wanted);
  for (const gateway::PlaybackRequest& request : mail.requests) obey(request);
  for (const gateway::Call& call : mail.calls) {
    if (call.service == gateway::kNextEventService) {
      seekToNextEvent(call);
    } else {
      node_->onCall(call, nowNs());
    }
  }
  for (const MapReply& refusal : std::exchange(refusals_, {})) node_->onMapReply(refusal);
}

void GatewayReplay::end() {
  ended_ = true;
  playing_ = false;
  tellState(false, "");
}

void GatewayReplay::run() {
  constexpr auto kTick = 100ms;
  Clock::time_point next_tick = Clock::now();
  tellState(false, "");
  while (!stopped_) {
    Clock::time_point due = next_tick;
    if (playing_ && !next_) end();
    if (playing_) {
      const double later =
          static_cast<double>(next_->log_ns - std::min(next_->log_ns, clock_log_ns_));
      const auto play =
          clock_began_ + std::chrono::nanoseconds(static_cast<std::int64_t>(later / speed_));
      if (play <= Clock::now()) {
        (void)pull();
        handle(waitUntil(Clock::time_point{}));
        continue;
      }
      due = std::min(due, play);
    }
    handle(waitUntil(due));
    if (Clock::now() < next_tick) continue;
    next_tick = Clock::now() + kTick;
    node_->tick(nowNs());
    server_->setTexts(node_->vitalSigns().healthz(nowNs()),
                      node_->vitalSigns().metrics(nowNs(), {}, {}));
  }
}

void GatewayReplay::stop() {
  const std::lock_guard lock(mutex_);
  mail_.stop = true;
  something_.notify_one();
}

}  // namespace perdure::tools
