// Options of the demo, and the commands that start its services.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/files/folder_lock.h"

namespace perdure::tools {

struct DemoOptions {
  std::string data;   ///< empty: the demo renders its own drive
  std::string model;  ///< empty: the network in ROOT/models, only for that drive
  std::string sequence, out, rate = "1";
  std::string rig;                  ///< empty: the drive's own calibration
  std::vector<std::string> topics;  ///< topics of a ROS recording: "cam0=/left/image_raw"
  std::string cache;       ///< folder of rendered drives; empty: ROOT/out, or the user's cache
  std::string root = ".";  ///< contains config/ and models/
  std::string programs;    ///< folder of the services; empty: that of this program
  std::string truth;       ///< root of KITTI tracking; empty: searched beside the data
  std::string truth_sequence;
  double seconds = 0.0;      ///< part of the drive; 0: all of it
  int shared_memory_mb = 0;  ///< shared memory for images; 0: none
  bool headless = false;
  bool keep = false;  ///< keeps everything running after the drive, until interrupted
};

/// The services in the order in which they are ended, from the source to the store.
inline constexpr const char* kServices[] = {"capture", "inference", "vio", "semantic_filter",
                                            "map_store"};
/// The service that only displays results; omitted if its program is not installed.
inline constexpr const char kGateway[] = "gateway";

struct ServicePlan {
  std::string name;                  ///< service name, such as "semantic_filter"
  std::vector<std::string> command;  ///< program and arguments
  std::string log;                   ///< path of the log file
};

struct DemoFolders {
  std::filesystem::path out, run, state;
  std::unique_ptr<FolderLock> lock;  ///< of OUT
};

/// Creates OUT and empties OUT/run, which belongs to this command. Throws StartupError if this
/// fails.
DemoFolders prepareFolders(const DemoOptions& options);

/// Shape points of each class, from the filter's configuration in ROOT. Throws StartupError if it
/// is invalid.
std::map<std::string, std::vector<Eigen::Vector3d>> shapesFor(const DemoOptions& options);

/// Plans the services in the order of kServices. Throws StartupError if a program is missing or
/// --rate is invalid.
std::vector<ServicePlan> planServices(const DemoOptions& options, const DemoFolders& folders);

/// Plans perdure-gateway on this port of the loopback interface; empty if it is not installed. For
/// a simulated drive, writes RUN/truth.json, which the page shows.
std::optional<ServicePlan> planGateway(const DemoOptions& options, const DemoFolders& folders,
                                       std::uint16_t port);
/// Returns port 8765 if it is free, else any free port.
std::uint16_t freePort();

}  // namespace perdure::tools
