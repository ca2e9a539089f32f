#include "tools/record/player.h"

#include <algorithm>
#include <type_traits>

#include "common/base/errors.h"
#include "common/bus/discovery.h"
#include "tools/bus_tools/common.h"

namespace perdure::tools {
namespace {

using namespace std::chrono_literals;

/// Topics that are not played by default: they contain queries and answers of processes, or the
/// state of processes that have ended.
const std::set<std::string> kNotByItself{"health", "map/query", "map/correct", "map/near",
                                         "map/reply"};

const std::map<std::string, std::set<std::string>> kInputs{
    {"vio", {"calibration", "imu", "speed", "frame/"}},
    {"inference", {"calibration", "frame/", "predictions"}},
    {"semantic_filter",
     {"calibration", "calibration/estimated", "odometry", "landmarks", "detections", "model",
      "inference/swap"}},
    {"map_store", {"odometry", "landmarks", "objects", "events"}}};

bool isHeardBy(const std::string& service, const std::string& topic) {
  const auto inputs = kInputs.find(service);
  if (inputs == kInputs.end()) {
    throw StartupError(ExitCode::kUsage,
                       "--for {}: is none of vio, inference, semantic_filter, map_store", service);
  }
  return inputs->second.contains(topic.starts_with("frame/") ? "frame/" : topic);
}

const char* writerOf(EventKind kind) {
  const bool of_the_map = kind == EventKind::kLoopClosed || kind == EventKind::kLoopWithdrawn ||
                          kind == EventKind::kRelocalised;
  return of_the_map ? "map_store" : "semantic_filter";
}

std::string listOf(const std::set<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  return list;
}

}  // namespace

Player::Player(const bus::Participant& participant, bus::WaitLoop& loop,
               replay::RecordedMessages& recording, const PlayOptions& options)
    : participant_(participant), loop_(loop), recording_(recording), options_(options) {
  chooseTopics();
  refuseContested();
  for (const std::string& topic : topics_) addVoice(topic);
}

void Player::chooseTopics() {
  for (const std::string& topic : options_.topics) {
    if (bus::findTopic(topic) == nullptr) refuseTopic(topic);
    topics_.insert(topic);
  }
  for (const auto& [topic, counted] : recording_.topics()) {
    if (!options_.topics.empty() || bus::findTopic(topic) == nullptr) continue;
    const bool wanted = options_.for_service.empty() ? !kNotByItself.contains(topic)
                                                     : isHeardBy(options_.for_service, topic);
    if (wanted) topics_.insert(topic);
  }
  std::set<std::string> absent;
  for (const std::string& topic : topics_) {
    if (!recording_.topics().contains(topic)) absent.insert(topic);
  }
  if (topics_.empty() || !absent.empty()) {
    throw StartupError(ExitCode::kUsage, "the recording has no " +
                                             (absent.empty() ? "such topic" : listOf(absent)) +
                                             "; `perdure record info` tells what it has");
  }
}

Player::Writers Player::otherWriters() {
  bus::Discovery discovery(participant_);
  const auto until = std::chrono::steady_clock::now() + 1s;
  while (!loop_.stopped() && std::chrono::steady_clock::now() < until) loop_.runOnce(100ms);
  Writers others;
  for (const bus::RemoteEndpoint& endpoint : discovery.endpoints()) {
    const std::string topic = replay::topicOf(endpoint.wire_name);
    if (!endpoint.writer || participant_.wireName(topic) != endpoint.wire_name) continue;
    if (!topics_.contains(topic)) continue;
    others[topic].insert(endpoint.process.empty() ? "somebody" : endpoint.process);
  }
  return others;
}

/// If a service that publishes events is running, leaves out only that service's recorded events.
void Player::settleEvents(Writers& others) {
  const auto events = others.find("events");
  if (events == others.end()) return;
  for (const char* service : {"semantic_filter", "map_store"}) {
    if (events->second.erase(service) == 0) continue;
    event_writers_.insert(service);
    left_out_.insert(std::string("those of ") + service + " among events");
  }
  if (events->second.empty()) others.erase(events);
}

/// Leaves out the outputs of running services that read this recording, because they publish these
/// topics themselves.
void Player::leaveToListeners(Writers& others) {
  const auto hears = [&](const std::string& process) {
    return kInputs.contains(process) && std::ranges::any_of(topics_, [&](const std::string& topic) {
             return !others.contains(topic) && isHeardBy(process, topic);
           });
  };
  const Writers all = others;
  for (const auto& [topic, processes] : all) {
    if (!std::ranges::all_of(processes, hears)) continue;
    left_out_.insert(topic + " (" + listOf(processes) + ")");
    topics_.erase(topic);
    others.erase(topic);
  }
}

void Player::refuse(const Writers& others) {
  std::set<std::string> contested;
  for (const auto& [topic, processes] : others) {
    contested.insert(topic + " (" + listOf(processes) + ")");
  }
  throw StartupError(ExitCode::kUnavailable,
                     "others write these topics now: " + listOf(contested) +
                         "; stop them, choose by --topics or --for, or play over them by --force");
}

/// Refuses topics that another process writes, because two writers would mix their data.
void Player::refuseContested() {
  Writers others = otherWriters();
  if (options_.force) return;
  settleEvents(others);
  if (options_.topics.empty() && options_.for_service.empty()) leaveToListeners(others);
  if (!others.empty()) refuse(others);
}

void Player::addVoice(const std::string& topic) {
  (void)bus::withTopic(topic, [&]<class T>(const bus::Topic<T>& typed) {
    auto writer = std::make_shared<bus::Writer<T>>(participant_, typed);
    const bus::Qos& qos = bus::findTopic(topic)->qos;
    voices_[topic] = {writer,
                      [this, writer](const replay::RecordedMessage& message) -> Result<void> {
                        const auto value = replay::valueOf<T>(message);
                        if (!value) return tl::unexpected(value.error());
                        if constexpr (std::is_same_v<T, Event>) {
                          if (event_writers_.contains(writerOf(value->kind))) {
                            return fail("left_out");
                          }
                        }
                        return writer->write(*value);
                      },
                      qos.latched&& qos.depth == 1};
  });
}

void Player::waitForReaders() {
  const auto until = std::chrono::steady_clock::now() +
                     std::chrono::nanoseconds(static_cast<std::int64_t>(options_.wait_s * 1e9));
  const auto unheard = [&] {
    return std::ranges::any_of(
        voices_, [](const auto& voice) { return voice.second.writer->matched() == 0; });
  };
  while (!loop_.stopped() && unheard() && std::chrono::steady_clock::now() < until) {
    loop_.runOnce(20ms);
  }
}

/// Waits until a log time is due; returns false if the loop was stopped meanwhile.
bool Player::waitUntil(std::uint64_t log_ns) {
  const double later = static_cast<double>(log_ns - first_ns_) / options_.rate;
  const auto due = began_ + std::chrono::nanoseconds(static_cast<std::int64_t>(later));
  while (!loop_.stopped()) {
    const auto wait = due - std::chrono::steady_clock::now();
    if (wait <= 0ns) return true;
    loop_.runOnce(wait);
  }
  return false;
}

/// Skips pauses of more than 10 s, as between two runs in one folder or after an invalid time.
void Player::leaveOutGap(std::uint64_t log_ns) {
  constexpr std::uint64_t kLongest = 10'000'000'000;
  const std::uint64_t gap = log_ns - last_ns_;
  last_ns_ = log_ns;
  if (gap <= kLongest) return;
  first_ns_ += gap;
  reasons_.add("gaps_left_out");
}

void Player::say(const replay::RecordedMessage& message) {
  const auto said = voices_.at(message.topic).say(message);
  if (said) {
    ++played_;
  } else {
    reasons_.add(message.topic + "_" + said.error().code);
  }
}

void Player::play() {
  recording_.rewind([this](const std::string& topic) { return topics_.contains(topic); });
  waitForReaders();
  first_ns_ = recording_.startNs() + static_cast<std::uint64_t>(options_.start_s * 1e9);
  last_ns_ = first_ns_;
  const auto length = static_cast<std::uint64_t>(options_.seconds * 1e9);
  began_ = std::chrono::steady_clock::now();
  while (const auto message = recording_.next()) {
    if (message->log_ns < first_ns_) {
      if (voices_.at(message->topic).latched) say(*message);
      continue;
    }
    leaveOutGap(message->log_ns);
    if (length > 0 && message->log_ns - first_ns_ > length) break;
    if (!waitUntil(message->log_ns)) return;
    say(*message);
  }
  constexpr double kLongest = 1.0;
  for (const auto& [topic, voice] : voices_) (void)voice.writer->waitForAcknowledgement(kLongest);
}

}  // namespace perdure::tools
