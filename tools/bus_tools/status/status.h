// `perdure status`: judges services, topics and host as one tree of worst levels.
#pragma once

#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/bus/domain.h"
#include "common/bus/topics.h"
#include "common/types/health.h"
#include "common/types/map.h"
#include "common/types/sensors.h"

namespace perdure::tools {

/// Levels in the order of severity. The values are the exit status.
enum class Level { kOk = 0, kDegraded = 1, kFailed = 2 };

struct StatusNode {
  std::string name;
  Level level = Level::kOk;
  std::string text = {};  ///< figures, and the fault with its fix, for people
  nlohmann::ordered_json data =
      nullptr;  ///< the figures of `text`, for programs; null if there are none
  std::vector<StatusNode> children = {};

  /// Appends a child and raises the level of this node to the child's level if that is worse.
  void add(StatusNode child);
};

/// Observations of one process. Ages are the time since the arrival of the last message.
struct ServiceSeen {
  Health health;
  double age_s = 0.0;
  double frames_hz = 0.0;      ///< rate of frames_out, from the last two messages
  double cpu = 0.0;            ///< share of one core, from the same; below 0 if unknown
  std::optional<double> up_s;  ///< time since the start of the process, if known
  int restarts = 0;            ///< restarts observed since the start of this watch
};

struct TopicSeen {
  std::size_t writers = 0, readers = 0;
  std::size_t messages = 0;  ///< number of messages from which the rate is computed
  double rate_hz = 0.0;
  std::optional<double> age_s;            ///< empty if no message arrived
  std::optional<double> latency_ms;       ///< median from capture to arrival, if on this host
  std::set<std::string> written_by = {};  ///< writers whose process name is known
};

struct DiskSeen {
  std::string folder;
  std::uint64_t free_bytes = 0, all_bytes = 0;
};
struct TemperatureSeen {
  std::string where;
  double celsius = 0.0;
  std::optional<double> critical;
};

struct IdentitySeen {
  std::string name;
  std::optional<std::chrono::system_clock::time_point> until;
  std::string problem;  ///< the fault and its fix; empty if the identity is valid
};
/// Reads the identities in the folder of bus.security that this user can read; sorted by name.
std::vector<IdentitySeen> lookAtIdentities(const std::string& folder);
bool endsSoon(const IdentitySeen& seen);

struct HostSeen {
  std::vector<DiskSeen> disks;
  std::vector<TemperatureSeen> temperatures;
  bool clock_synchronised = false;
  bool several_hosts = false;  ///< whether the topics use a network
  bool closed = false;         ///< whether bus.security is set
  std::vector<IdentitySeen> identities;
};

struct StatusSeen {
  std::string vehicle;
  std::map<std::string, ServiceSeen> services;  ///< key: process name
  std::map<std::string, TopicSeen> topics;      ///< key: topic name, including "frame/cam0"
  std::optional<Calibration> calibration;
  std::optional<MapHeader> map_header;
  std::optional<MapFrame> map_frame;  ///< includes the state of the map's graph
  HostSeen host;
};

StatusNode judge(const StatusSeen& seen);
StatusNode judgeMap(const StatusSeen& seen);

const char* levelWord(Level level);
/// Formats the tree as lines of text with branches; `colour` adds terminal colours.
std::string toText(const StatusNode& node, bool colour);
nlohmann::ordered_json toJson(const StatusNode& node);
/// Formats JSON on one line, or indented if `indent` ≥ 0. Replaces bytes that are not UTF-8,
/// because messages of processes may contain any bytes.
std::string dumped(const nlohmann::ordered_json& json, int indent = -1);

/// Reads the state of the host; folders that do not exist are ignored.
HostSeen lookAtHost(const std::vector<std::string>& folders, const bus::Options& options);

}  // namespace perdure::tools
