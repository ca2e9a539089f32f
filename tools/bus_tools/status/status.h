// `perdure status`: what was seen of services, topics and the host, judged as one tree in which the
// worst state dominates.
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

/// In order of gravity; as exit status 0, 1, 2.
enum class Level { kOk = 0, kDegraded = 1, kFailed = 2 };

struct StatusNode {
  std::string name;
  Level level = Level::kOk;
  std::string text = {};  ///< for people: figures; what is wrong and the mend
  nlohmann::ordered_json data =
      nullptr;  ///< the same figures for programs; null where there are none
  std::vector<StatusNode> children = {};

  /// Takes it in; its level counts here too.
  void add(StatusNode child);
};

/// What was heard of one process. Ages are since the last message arrived.
struct ServiceSeen {
  Health health;
  double age_s = 0.0;
  double frames_hz = 0.0;      ///< of frames_out, between its last two messages
  double cpu = 0.0;            ///< of one core, likewise; below 0 where it is not known
  std::optional<double> up_s;  ///< since its start, where that is known
  int restarts = 0;            ///< that were seen since this listens
};

struct TopicSeen {
  std::size_t writers = 0, readers = 0;
  std::size_t messages = 0;  ///< in the window of the rate
  double rate_hz = 0.0;
  std::optional<double> age_s;            ///< nothing where no message came
  std::optional<double> latency_ms;       ///< median, from capture to here; of one host
  std::set<std::string> written_by = {};  ///< names of processes, where they have one
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
  std::string problem;  ///< with the mend, where it is not fit
};
/// Of bus.security, as far as this user can read it; sorted by name.
std::vector<IdentitySeen> lookAtIdentities(const std::string& folder);
bool endsSoon(const IdentitySeen& seen);

struct HostSeen {
  std::vector<DiskSeen> disks;
  std::vector<TemperatureSeen> temperatures;
  bool clock_synchronised = false;
  bool several_hosts = false;  ///< the topics are on a network
  bool closed = false;         ///< bus.security is on
  std::vector<IdentitySeen> identities;
};

struct StatusSeen {
  std::string vehicle;
  std::map<std::string, ServiceSeen> services;  ///< by process
  std::map<std::string, TopicSeen> topics;      ///< by name, "frame/cam0" among them
  std::optional<Calibration> calibration;
  std::optional<MapHeader> map_header;
  std::optional<MapFrame> map_frame;  ///< with the map's graph
  HostSeen host;
};

StatusNode judge(const StatusSeen& seen);
/// A part of it.
StatusNode judgeMap(const StatusSeen& seen);

const char* levelWord(Level level);
/// Lines with branches; `colour` for a terminal.
std::string toText(const StatusNode& node, bool colour);
nlohmann::ordered_json toJson(const StatusNode& node);
/// On one line, or indented. What processes say of themselves may be any bytes: what is no UTF-8 is
/// replaced.
std::string dumped(const nlohmann::ordered_json& json, int indent = -1);

/// Of the folders that exist.
HostSeen lookAtHost(const std::vector<std::string>& folders, const bus::Options& options);

}  // namespace perdure::tools
