// Receives the messages of a running system and writes the files of `perdure pipeline`.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "common/bus/wait_loop.h"
#include "common/types/detections.h"
#include "common/types/health.h"
#include "common/types/objects.h"
#include "tools/outputs/output_writer.h"
#include "tools/outputs/run_doubts.h"

namespace perdure::tools {

/// Measures latencies; counts each frame once. Valid on one host only, because ages use the
/// CLOCK_MONOTONIC of capture.
class LatencyMeter {
 public:
  /// `now_ns`: arrival of the message at this process.
  void onObjects(const Objects& objects, std::int64_t now_ns);
  void onDetections(const Detections& detections);

  double last_ms() const { return last_ms_; }
  /// {"latency_ms": {"median", "p99"}, "latency_beyond_network_ms": {…}}: time from capture to the
  /// arrival of objects; the second is without Detections::forward_s.
  nlohmann::ordered_json report() const;

 private:
  struct Frame {
    double age_ms = -1.0;      ///< below 0: no objects yet
    double forward_ms = -1.0;  ///< below 0: unknown
  };
  std::map<std::uint64_t, Frame> frames_;  ///< key: sequence number
  double last_ms_ = 0.0;
};

/// Sums the counts of one service over its processes, because each process counts from 0.
class ServiceCounts {
 public:
  void add(const Health& health);
  /// Frames of processes that run at the same time, as in a swap of the network, count only once.
  std::uint64_t framesIn() const { return in_; }
  std::uint64_t framesOut() const { return out_; }
  std::uint64_t dropped() const { return dropped_; }
  double cpuSeconds() const;
  std::map<std::string, std::uint64_t> reasons() const;
  std::vector<pid_t> pids() const;

 private:
  struct Process {
    Health health;
    std::uint64_t in = 0, out = 0, dropped = 0;  ///< totals before its first frame
  };
  std::map<InstanceId, Process> by_instance_;
  std::uint64_t in_ = 0, out_ = 0, dropped_ = 0;
};

class Reporter {
 public:
  /// Subscribes to the topics. The caller runs `loop`, which must outlive the reporter. `shapes`
  /// are those of the filter's class priors, for a network whose boxes enclose outlines.
  Reporter(const bus::Participant& participant, bus::WaitLoop& loop, OutputWriter& outputs,
           std::map<std::string, ShapePoints> shapes);

  std::size_t odometryFrames() const { return odometry_.size(); }
  double secondsOfDrive() const { return toSeconds(newest_time_ - first_time_); }
  /// Whether the drive has ended and every frame with odometry has objects.
  bool drained() const;
  /// Arrival in ns of the last message about a frame, by CLOCK_MONOTONIC.
  std::int64_t lastMessageNs() const { return last_message_ns_; }
  const Health* healthOf(const std::string& process) const;
  /// The processes that sent Health messages under this name.
  std::vector<pid_t> pidsOf(const std::string& process) const;

  /// Progress text such as "frame 57/154  10.0 Hz  objects 9  latency 83 ms".
  std::string progressLine(std::size_t frames_in_all) const;
  /// Services, latency and message counts. The caller adds the restarts.
  nlohmann::ordered_json report() const;
  RunFacts facts(const replay::DataFindings& before) const;
  /// Processor time per frame of each service, averaged over each second.
  nlohmann::ordered_json timing() const;

 private:
  void onOdometry(const Odometry& odometry);
  void onObjects(const Objects& objects);
  void onHealth(const Health& health);
  void onModel(const ModelInfo& model);

  OutputWriter& outputs_;
  std::map<std::string, ShapePoints> shapes_;
  bus::Reader<Calibration> calibration_reader_;
  bus::Reader<Odometry> odometry_reader_;
  bus::Reader<Landmarks> landmarks_reader_;
  bus::Reader<ModelInfo> model_reader_;
  bus::Reader<Detections> detections_reader_;
  bus::Reader<Objects> objects_reader_;
  bus::Reader<Event> events_reader_;
  bus::Reader<Health> health_reader_;
  std::set<std::uint64_t> odometry_, objects_, detections_;
  std::uint64_t newest_frame_ = 0, boxes_ = 0;
  TimePoint first_time_, newest_time_;
  std::int64_t last_message_ns_ = 0;
  LatencyMeter latency_;
  std::map<std::string, Health> newest_health_;
  std::map<std::string, ServiceCounts> services_;
  struct Span {
    std::uint64_t frames = 0;
    double cpu_ms = 0.0;
  };
  std::map<std::string, std::vector<Span>> spans_;
};

/// The time of CLOCK_MONOTONIC in ns, as in FrameStamp::captured_ns.
std::int64_t monotonicNs();

}  // namespace perdure::tools
