// Runs the five services over a lap that is driven repeatedly, and records their messages.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "common/bus/topics.h"
#include "common/bus/wait_loop.h"
#include "tests/process/support.h"
#include "tools/demo/plan.h"
#include "tools/demo/reporter.h"

namespace perdure::test {

struct SoakPoint {
  double s = 0.0;                           ///< time since the first frame was published
  std::map<std::string, double> memory_mb;  ///< resident memory, by service
  std::size_t held = 0, confirmed = 0;      ///< objects of the working set
  std::uint64_t on_map = 0;                 ///< number of objects in map/header
};

/// A line of a log with at least warning level; its numbers are replaced by "#".
struct Complaint {
  std::string service, text;
  std::size_t count = 0;
  std::size_t most_in_a_minute = 0;
};

class SoakRun {
 public:
  /// Renders the lap into `folder` if it does not exist yet; all other files there are made again.
  explicit SoakRun(std::filesystem::path folder, int shared_memory_mb = 0);

  /// Starts the services, listens for `seconds` from the first frame on, and stops the services in
  /// order. Prints one line per minute. Returns false if a service does not start, or exits.
  bool run(double seconds);

  const std::vector<SoakPoint>& points() const { return points_; }  ///< one per second
  /// Counts of frames, from the first one with objects (vio starts with the first motion) to a
  /// second before the last one: all frames, and those without an output.
  struct Frames {
    std::uint64_t given = 0, without_odometry = 0, without_detections = 0, without_objects = 0;
  };
  Frames frames() const;
  const std::map<std::string, Health>& health() const { return health_; }
  std::vector<Complaint> complaints() const;
  /// Returns the ids of all objects that were confirmed at some time of lap `lap` (from 0).
  std::set<ObjectId> confirmedIn(std::size_t lap) const;
  std::size_t laps() const { return confirmed_.size(); }
  /// Returns the growth of a service's memory between two times, in MB. Compares the medians over
  /// the minutes that end at `from_s` and `to_s`.
  double growth_mb(const std::string& service, double from_s, double to_s) const;
  /// The drift at the start of each lap, relative to the first lap that has odometry there: metres
  /// and degrees about gravity. The true pose is the same in each lap.
  struct Walk {
    std::size_t lap = 0;
    double m = 0.0, up_m = 0.0, deg = 0.0;
  };
  std::vector<Walk> walk() const;
  /// Returns the largest number of objects in the filter in any frame up to `until_s`.
  std::size_t mostHeld(double until_s) const;
  nlohmann::ordered_json report() const;
  /// Draws the memory of each service, and the number of objects, over time.
  void draw(const std::filesystem::path& file) const;

 private:
  void start();
  void listen();
  void note();
  bool allLive();
  void end();
  double seconds() const;

  std::filesystem::path folder_;
  int shared_memory_mb_;
  std::size_t frames_a_lap_ = 0;
  bus::Domain domain_;
  bus::Participant participant_;
  bus::Reader<Calibration> calibration_reader_;
  bus::Reader<Odometry> odometry_reader_;
  bus::Reader<Detections> detections_reader_;
  bus::Reader<Objects> objects_reader_;
  bus::Reader<MapHeader> header_reader_;
  bus::Reader<Health> health_reader_;
  bus::WaitLoop loop_;
  std::vector<tools::ServicePlan> plans_;
  std::map<std::string, std::unique_ptr<Child>> children_;
  std::map<std::string, Health> health_;
  std::set<std::uint64_t> odometry_, detections_, objects_;
  std::vector<std::set<ObjectId>> confirmed_;   ///< confirmed objects by lap
  std::map<std::size_t, RigidTransform> T_WB_;  ///< pose at the start of each lap
  tools::LatencyMeter latency_;
  SoakPoint now_;
  std::vector<SoakPoint> points_;
  std::int64_t begun_ns_ = 0;
};

}  // namespace perdure::test
