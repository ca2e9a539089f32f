#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>
#include <memory>
#include <set>

#include "common/bus/discovery.h"
#include "tools/bus_tools/common.h"
#include "tools/perdure/commands.h"

namespace perdure::tools {
namespace {

struct TopicsOptions {
  bus::Options bus;
  double seconds = 1.5;
};

struct Row {
  std::string type;
  std::multiset<std::string> writers, readers;
};

std::string qosText(const bus::Qos& qos) {
  std::string text = qos.reliable ? "reliable" : "best-effort";
  text += " " + std::to_string(qos.depth);
  if (qos.latched) text += ", latched";
  if (qos.kept) text += ", the newest kept";
  if (qos.exclusive) text += ", exclusive";
  return text;
}

std::string listed(const std::multiset<std::string>& names) {
  std::string text = std::to_string(names.size());
  std::string separator = " (";
  for (const std::string& name : names) {
    text += separator + (name.empty() ? "unnamed" : name);
    separator = ", ";
  }
  return names.empty() ? text : text + ")";
}

void print(const std::string& name, const Row& row) {
  const bus::TopicInfo* info = bus::findTopic(name);
  char rate[32] = "on change";
  if (info != nullptr && info->rate_hz > 0) {
    std::snprintf(rate, sizeof(rate), "%g Hz", info->rate_hz);
  }
  std::printf("%-14s %-26s %-24s %-10s %-28s %s\n", name.c_str(), row.type.c_str(),
              info != nullptr ? qosText(info->qos).c_str() : "not in the table",
              info != nullptr ? rate : "", listed(row.writers).c_str(),
              listed(row.readers).c_str());
}

std::map<std::string, Row> rowsOf(const std::vector<bus::RemoteEndpoint>& endpoints,
                                  const std::string& prefix) {
  std::map<std::string, Row> rows;
  for (const bus::TopicInfo& info : bus::topicTable()) {
    if (!info.name.ends_with('/')) rows[std::string(info.name)].type = info.typeName();
  }
  for (const bus::RemoteEndpoint& endpoint : endpoints) {
    if (!endpoint.wire_name.starts_with(prefix)) continue;
    Row& row = rows[endpoint.wire_name.substr(prefix.size())];
    row.type = endpoint.type_name;
    (endpoint.writer ? row.writers : row.readers).insert(endpoint.process);
  }
  return rows;
}

void runTopics(const TopicsOptions& options) {
  const bus::Domain domain(options.bus);
  const bus::Participant participant(domain, "perdure topics");
  bus::Discovery discovery(participant);
  bus::WaitLoop loop(participant);
  runLoop(loop, options.seconds);
  std::printf("%-14s %-26s %-24s %-10s %-28s %s\n", "topic", "type", "quality of service", "rate",
              "writers", "readers");
  const std::string prefix = participant.wireName("");
  for (const auto& [name, row] : rowsOf(discovery.endpoints(), prefix)) print(name, row);
}

}  // namespace

void setUpTopics(CLI::App& command) {
  auto options = std::make_shared<TopicsOptions>();
  command.add_option("--seconds", options->seconds, "how long to look for processes")
      ->capture_default_str();
  addBusOptions(command, options->bus);
  command.callback([options] { runTopics(*options); });
}

}  // namespace perdure::tools
