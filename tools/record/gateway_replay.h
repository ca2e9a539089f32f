// Replays a recording to the gateway's page and to Foxglove, without a bus. Clients control it.
#pragma once

#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "common/replay/recordings/recorded_messages.h"
#include "services/gateway/node.h"
#include "services/gateway/web/server.h"

namespace perdure::tools {

class GatewayReplay {
 public:
  /// Determines the time range of the recording, and starts `start_s` after its first frame. Throws
  /// StartupError if the recording has nothing to show or ends before `start_s`, or if the port is
  /// not available.
  GatewayReplay(replay::RecordedMessages& recording, const gateway::Config& config,
                const gateway::PlaybackRequest& start, double start_s = 0.0);
  ~GatewayReplay();

  std::uint16_t port() const { return server_->port(); }
  gateway::TimeRange range() const { return {sensorTime(first_.log_ns), sensorTime(last_.log_ns)}; }
  void run();
  void stop();  ///< may be called from any thread

 private:
  using Clock = std::chrono::steady_clock;
  /// The time of a message by the recorder's clock and by the sensors' clock.
  struct Instant {
    std::uint64_t log_ns = 0;
    TimePoint time;
  };
  struct Mail {
    /// Every change of the wanted channels. All are handled, so that a client that closes and opens
    /// a channel gets its messages again.
    std::vector<gateway::Channels> wanted;
    std::deque<gateway::Call> calls;
    std::deque<gateway::PlaybackRequest> requests;
    bool stop = false;
    bool empty() const { return wanted.empty() && calls.empty() && requests.empty() && !stop; }
  };

  void measure();
  void refuseAfterTheEnd(double start_s) const;
  TimePoint sensorTime(std::uint64_t log_ns) const;
  std::uint64_t logTime(TimePoint time) const;
  std::unique_ptr<gateway::Node> freshNode();
  void seek(std::uint64_t log_ns);
  void seekToNextEvent(const gateway::Call& call);
  void recallRig(std::uint64_t log_ns);
  void recallGraph(std::uint64_t log_ns);
  void repeatFrames(const gateway::Channels& before);
  void showFrame();
  bool pull();
  void end();
  void feed(const replay::RecordedMessage& message);
  void obey(const gateway::PlaybackRequest& request);
  void look(const gateway::Channels& wanted);
  Mail waitUntil(Clock::time_point due);
  void handle(Mail mail);
  void setClock();
  void tellState(bool did_seek, const std::string& id);
  std::int64_t nowNs() const;

  replay::RecordedMessages& recording_;
  const gateway::Config config_;
  Instant first_, last_;
  std::uint64_t begin_ns_ = 0, end_ns_ = 0;
  std::unique_ptr<gateway::Node> node_;
  gateway::Channels wanted_;
  std::optional<Calibration> calibration_;
  std::optional<ModelInfo> model_;
  std::optional<MapReply> graph_;  ///< newest graph of the map
  std::optional<replay::RecordedMessage> next_;
  /// Newest messages of topics without history, for clients that open a channel.
  std::map<std::string, std::deque<replay::RecordedMessage>> newest_;
  std::uint64_t at_ns_ = 0;  ///< log time of the display
  bool playing_ = true, stopped_ = false, ended_ = false;
  double speed_ = 1.0;
  std::uint64_t clock_log_ns_ = 0;
  Clock::time_point clock_began_;
  bool fed_objects_ = false;
  std::vector<MapReply> refusals_;

  std::mutex mutex_;
  std::condition_variable something_;
  Mail mail_;
  std::unique_ptr<gateway::web::Server> server_;  // its thread uses the members above
};

}  // namespace perdure::tools
