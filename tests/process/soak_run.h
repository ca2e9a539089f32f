// The five services over a lap that is driven again and again, and what they say meanwhile.
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
#include "tools/demo/latency.h"
#include "tools/demo/plan.h"

namespace perdure::test {

struct SoakPoint {
  double s = 0.0;                           ///< since the first frame was handed out
  std::map<std::string, double> memory_mb;  ///< resident, by service
  std::size_t held = 0, confirmed = 0;      ///< things of the working set
  std::uint64_t on_map = 0;                 ///< as map/header says
};

/// A line of a log that is neither information nor finer; numbers in it are "#".
struct Complaint {
  std::string service, text;
  std::size_t count = 0;
  std::size_t most_in_a_minute = 0;
};

class SoakRun {
 public:
  /// Renders the lap into `folder` where it is not there yet; all else there is made anew.
  explicit SoakRun(std::filesystem::path folder, int shared_memory_mb = 0);

  /// Starts the services, listens for so long from the first frame on, ends them in order. A line
  /// a minute goes to standard output. False where a service does not start, or ends.
  bool run(double seconds);

  const std::vector<SoakPoint>& points() const { return points_; }  ///< one a second
  /// Of the frames from the first with objects (vio starts with the first motion) to a second
  /// before the last: how many there are, and without what.
  struct Frames {
    std::uint64_t given = 0, without_odometry = 0, without_detections = 0, without_objects = 0;
  };
  Frames frames() const;
  const std::map<std::string, Health>& health() const { return health_; }
  std::vector<Complaint> complaints() const;
  /// Ids of the things that were confirmed at any time of the lap that began at `lap` (from 0).
  std::set<ObjectId> confirmedIn(std::size_t lap) const;
  std::size_t laps() const { return confirmed_.size(); }
  /// Growth of a service's memory between two spans, MB: medians of a minute's points that end at
  /// each time, s.
  double growth_mb(const std::string& service, double from_s, double to_s) const;
  /// How far the body is from where it was at the same place of the lap before all others that has
  /// odometry there: metres and degrees about gravity, by lap. The body really is where it was.
  struct Walk {
    std::size_t lap = 0;
    double m = 0.0, up_m = 0.0, deg = 0.0;
  };
  std::vector<Walk> walk() const;
  /// The most things that the filter held in any frame up to then.
  std::size_t mostHeld(double until_s) const;
  nlohmann::ordered_json report() const;
  /// Memory of each service, and objects, over time.
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
  std::vector<std::set<ObjectId>> confirmed_;   ///< by lap
  std::map<std::size_t, RigidTransform> T_WB_;  ///< at the start of a lap
  tools::LatencyMeter latency_;
  SoakPoint now_;
  std::vector<SoakPoint> points_;
  std::int64_t begun_ns_ = 0;
};

}  // namespace perdure::test
