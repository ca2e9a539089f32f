// What the demo is asked for, and how the services are to be started for it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace perdure::tools {

struct DemoOptions {
  std::string data;   ///< empty: the drive that the demo renders for itself
  std::string model;  ///< empty: the one in ROOT/models, for that drive only
  std::string sequence, out, rate = "1";
  std::string rig;                  ///< empty: the drive's own calibration
  std::vector<std::string> topics;  ///< of a recording of ROS: "cam0=/left/image_raw"
  std::string cache;       ///< where rendered drives are kept; empty: ROOT/out, or the user's cache
  std::string root = ".";  ///< where config/ and models/ are
  std::string programs;    ///< folder of the services; empty: that of this program
  std::string truth;       ///< root of KITTI tracking; empty: looked for beside the data
  std::string truth_sequence;
  double seconds = 0.0;      ///< of the drive; 0: all of it
  int shared_memory_mb = 0;  ///< of images; 0: none
  bool headless = false;
  bool keep = false;  ///< all goes on after the end of the drive, until it is interrupted
};

/// The services in the order in which they are ended: from the source to the store.
inline constexpr const char* kServices[] = {"capture", "inference", "vio", "semantic_filter",
                                            "map_store"};
/// What only shows them; left out where its program is not installed.
inline constexpr const char kGateway[] = "gateway";

struct ServicePlan {
  std::string name;                  ///< "semantic_filter"
  std::vector<std::string> command;  ///< program and arguments
  std::string log;                   ///< file
};

/// Folders of a demo's run, all absolute.
struct DemoFolders {
  std::filesystem::path out, run, state;
};

/// Makes OUT and empties OUT/run, which is this command's own. Throws StartupError.
DemoFolders prepareFolders(const DemoOptions& options);

/// What things of each class fill of their cuboids, by the filter's configuration in ROOT. Throws
/// StartupError where that, or the class priors that it names, cannot be used.
std::map<std::string, std::vector<Eigen::Vector3d>> shapesFor(const DemoOptions& options);

/// In the order of kServices. Throws StartupError where a program is missing or --rate is wrong.
std::vector<ServicePlan> planServices(const DemoOptions& options, const DemoFolders& folders);

/// perdure-gateway on this port of loopback; nothing where it is not there.
std::optional<ServicePlan> planGateway(const DemoOptions& options, const DemoFolders& folders,
                                       std::uint16_t port);
/// 8765 where nobody listens there, else any free one.
std::uint16_t freePort();

/// The configuration of supervisord: a service that ends by a fault is started again at once.
std::string supervisorConfig(const std::vector<ServicePlan>& services, const DemoFolders& folders,
                             const std::string& socket, const std::filesystem::path& root);

}  // namespace perdure::tools
