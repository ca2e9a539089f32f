#include "tools/record/recorder.h"

#include <algorithm>

#include "common/base/errors.h"
#include "common/wire/cdr.h"
#include "tools/bus_tools/common.h"

namespace perdure::tools {
namespace {

namespace mcap = replay::mcap;

constexpr std::int64_t kLongestChunk = 500'000'000;  // ns: most that a killed recorder loses
constexpr std::size_t kLargestChunk = 4u << 20;      // bytes
constexpr char kFramePrefix[] = "frame/";

template <class Clock>
std::int64_t nowOf() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now().time_since_epoch())
      .count();
}

/// Whether a topic is published once and describes other messages, like calibration and model.
bool isLatchedAlone(const bus::TopicInfo& info) {
  return info.qos.latched && info.qos.depth == 1 && info.rate_hz == 0;
}

}  // namespace

LogClock::LogClock()
    : real_minus_steady_(nowOf<std::chrono::system_clock>() - nowOf<std::chrono::steady_clock>()) {}

std::int64_t LogClock::steadyNs() { return nowOf<std::chrono::steady_clock>(); }

std::uint64_t LogClock::nowNs() const {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(real_minus_steady_ + steadyNs(), 0));
}

std::int64_t LogClock::setByNs() const {
  return nowOf<std::chrono::system_clock>() - steadyNs() - real_minus_steady_;
}

Recorder::Recorder(service::Context& context, const RecorderOptions& options, Store& store)
    : context_(context),
      options_(options),
      store_(store),
      discovery_(context.participant()),
      catalogue_(std::make_shared<mcap::Catalogue>()),
      latched_(std::make_shared<std::vector<Latched>>()),
      watch_(options.fault) {
  // The topics keep the order of the table, so that a cause precedes a simultaneous effect.
  std::vector<std::string> topics = options.topics;
  for (const bus::TopicInfo& info : bus::topicTable()) {
    const bool wanted = options.topics.empty() && info.recorded && !info.name.ends_with('/');
    if (wanted) topics.emplace_back(info.name);
  }
  if (options.images && options.topics.empty()) lookForCameras();
  for (const std::string& topic : topics) listen(topic);
  health_ = &context.on(bus::kTopic<Health>, [this](const Health& health) {
    if (health.instance == context_.instance()) return;  // own faults trigger no dump
    onFault(watch_.onHealth(health, FaultWatch::Time::clock::now()));
  });
  context.countReasons([this](ReasonCounts& counts) { report(counts); });
  context.onHealth([this] { updateHealth(); });
  context.every(std::chrono::milliseconds(100), [this] {
    if (!empty() && LogClock::steadyNs() - draft_began_ns_ >= kLongestChunk) cut();
    onFault(watch_.onSilent(health_->silent(), FaultWatch::Time::clock::now()));
  });
  if (options.images && options.topics.empty()) {
    context.every(std::chrono::milliseconds(500), [this] { lookForCameras(); });
  }
}

void Recorder::lookForCameras() {
  for (const bus::RemoteEndpoint& endpoint : discovery_.endpoints()) {
    const std::string prefix = context_.participant().wireName(kFramePrefix);
    if (!endpoint.writer || !endpoint.wire_name.starts_with(prefix)) continue;
    const std::string topic = kFramePrefix + endpoint.wire_name.substr(prefix.size());
    if (bus::findTopic(topic) != nullptr) listen(topic);
  }
}

void Recorder::listen(const std::string& topic) {
  if (sources_.contains(topic)) return;
  const bus::TopicInfo* info = bus::findTopic(topic);
  if (info == nullptr) refuseTopic(topic);
  std::unique_ptr<Source> source(new Source{bus::CdrReader(context_.participant(), topic),
                                            addChannel(topic, *info), 0, isLatchedAlone(*info),
                                            topic.starts_with(kFramePrefix) ? images_ : draft_});
  Source& kept = *sources_.emplace(topic, std::move(source)).first->second;
  context_.loop().on(kept.reader,
                     [this, &kept](const bus::CdrMessage& message) { onMessage(kept, message); });
}

std::uint16_t Recorder::addChannel(const std::string& topic, const bus::TopicInfo& info) {
  auto catalogue = std::make_shared<mcap::Catalogue>(*catalogue_);
  const std::string type = info.typeName();
  std::uint16_t schema = 0;
  for (const auto& [id, known] : catalogue->schemas) {
    if (known.name == type) schema = id;
  }
  if (schema == 0) {
    schema = static_cast<std::uint16_t>(catalogue->schemas.size() + 1);
    catalogue->schemas[schema] = {schema, type, "omgidl", wire::idlOf(type)};
  }
  const auto id = static_cast<std::uint16_t>(catalogue->channels.size() + 1);
  catalogue->channels[id] = {id, schema, context_.participant().wireName(topic), "cdr"};
  catalogue_ = std::move(catalogue);
  return id;
}

void Recorder::onMessage(Source& source, const bus::CdrMessage& message) {
  if (empty()) draft_began_ns_ = LogClock::steadyNs();
  source.draft.add({source.channel, ++source.sequence, clock_.nowNs(),
                    static_cast<std::uint64_t>(std::max<std::int64_t>(message.written_ns, 0)),
                    message.bytes});
  ++messages_;
  context_.health().frameIn();
  if (source.latched) keepLatched(source, message.bytes);
  if (source.draft.bytes() >= kLargestChunk) cut();
}

/// Stores a latched message; if it repeats an earlier one, the earlier one is removed.
void Recorder::keepLatched(const Source& source, std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kMost = 16;
  auto latched = std::make_shared<std::vector<Latched>>(*latched_);
  Latched added{source.channel, source.sequence, {bytes.begin(), bytes.end()}};
  std::erase_if(*latched, [&](const Latched& other) {
    return other.channel == added.channel && other.data == added.data;
  });
  if (latched->size() == kMost) latched->erase(latched->begin());
  latched->push_back(std::move(added));
  latched_ = std::move(latched);
}

void Recorder::cut(bool fault) {
  if (empty() && !fault) return;
  if (empty()) draft_began_ns_ = LogClock::steadyNs();
  if (!images_.empty())
    store_.give({std::exchange(images_, {}), catalogue_, latched_, draft_began_ns_});
  store_.give({std::exchange(draft_, {}), catalogue_, latched_, draft_began_ns_, fault});
}

void Recorder::onFault(const std::optional<std::string>& what) {
  if (!what) return;
  ++faults_;
  context_.log().warn("fault: {}", *what);
  cut(true);
}

void Recorder::updateHealth() {
  const StoreReport stored = store_.report();
  std::string problem = stored.problem;
  if (stored.disk_full) {
    problem += "; recording goes on as soon as there is room: free some, or lower --quota";
  }
  constexpr std::int64_t kTold = 10'000'000'000;  // ns; Health reports a slow disk for this time
  const std::int64_t now = LogClock::steadyNs();
  if (stored.overrun > overrun_) slow_until_ns_ = now + kTold;
  overrun_ = stored.overrun;
  if (problem.empty() && now < slow_until_ns_) {
    problem = "the disk is too slow: " + std::to_string(stored.overrun) +
              " chunks are lost so far; record without images, or on a faster disk";
  }
  context_.health().state(problem.empty() ? HealthState::kOk : HealthState::kDegraded, problem);
  context_.health().setDropped(stored.lost);
}

void Recorder::report(ReasonCounts& counts) const {
  const StoreReport stored = store_.report();
  const auto add = [&](const char* reason, std::uint64_t n) {
    if (n > 0) counts.add(reason, n);
  };
  for (const auto& [topic, source] : sources_) source->reader.report(counts);
  add("messages_lost_disk", stored.lost);
  add("chunks_lost_disk_slow", stored.overrun);
  add("chunks_lost_memory", stored.cut_short);
  add("files_removed_quota", stored.removed);
  add("faults", faults_);
  add("dumps", stored.dumps);
  constexpr std::int64_t kSet = 500'000'000;
  if (std::abs(clock_.setByNs()) > kSet) counts.add("clock_was_set");
}

}  // namespace perdure::tools
