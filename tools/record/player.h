// Publishes a recording on the bus: the same messages at the same time intervals.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "common/bus/wait_loop.h"
#include "common/replay/recordings/recorded_messages.h"

namespace perdure::tools {

struct PlayOptions {
  std::vector<std::string> topics;      ///< empty: all except health and map queries and answers
  std::string for_service;              ///< service whose inputs replace `topics`
  double rate = 1.0;                    ///< seconds of the recording per second
  double start_s = 0.0, seconds = 0.0;  ///< start and duration; 0: to the end
  double wait_s = 2.0;                  ///< longest wait for a reader of each topic
  bool loop = false, force = false;
};

class Player {
 public:
  /// Takes about a second to discover other processes. If no topics are named, leaves out the
  /// outputs of services that read this recording. Throws StartupError for an unknown topic, a
  /// topic that is not in the recording, or, unless `force`, a topic that another process writes.
  Player(const bus::Participant& participant, bus::WaitLoop& loop,
         replay::RecordedMessages& recording, const PlayOptions& options);

  /// Plays once to the end, or until the loop is stopped.
  void play();
  std::uint64_t played() const { return played_; }
  const ReasonCounts& reasons() const { return reasons_; }
  const std::set<std::string>& topics() const { return topics_; }
  /// Topics that were left out, with their writer, for example "map/frame (map_store)".
  const std::set<std::string>& leftOut() const { return left_out_; }

 private:
  struct Voice {
    std::shared_ptr<bus::RawWriter> writer;
    std::function<Result<void>(const replay::RecordedMessage&)> say;
    bool latched = false;
  };
  using Writers = std::map<std::string, std::set<std::string>>;  ///< processes, by topic
  void chooseTopics();
  Writers otherWriters();
  void settleEvents(Writers& others);
  void leaveToListeners(Writers& others);
  static void refuse(const Writers& others);
  void refuseContested();
  void addVoice(const std::string& topic);
  void waitForReaders();
  void leaveOutGap(std::uint64_t log_ns);
  bool waitUntil(std::uint64_t log_ns);
  void say(const replay::RecordedMessage& message);

  const bus::Participant& participant_;
  bus::WaitLoop& loop_;
  replay::RecordedMessages& recording_;
  const PlayOptions options_;
  std::set<std::string> topics_, left_out_;
  std::set<std::string> event_writers_;  ///< running services that publish events
  std::map<std::string, Voice> voices_;
  std::uint64_t first_ns_ = 0;  ///< log time due at the start, plus the skipped gaps
  std::uint64_t last_ns_ = 0, played_ = 0;
  std::chrono::steady_clock::time_point began_;
  ReasonCounts reasons_;
};

}  // namespace perdure::tools
