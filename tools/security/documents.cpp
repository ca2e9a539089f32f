#include "tools/security/documents.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

namespace perdure::tools {
namespace {

/// All domains that bus.domain can select.
constexpr char kDomains[] = "<domains><id_range><min>0</min><max>230</max></id_range></domains>";
constexpr char kHead[] =
    "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
    "<dds xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" "
    "xsi:noNamespaceSchemaLocation=\"http://www.omg.org/spec/DDS-Security/20170901/"
    "omg_shared_ca_{}.xsd\">\n";

std::string timeText(TimePoint at) {
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}",
                     std::chrono::time_point_cast<std::chrono::seconds>(at));
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '&':
        out += "&amp;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string topicsXml(const char* verb, const std::string& prefix,
                      const std::vector<std::string>& topics) {
  if (topics.empty()) return {};
  std::string xml = fmt::format("<{}><topics>", verb);
  for (const std::string& topic : topics) xml += fmt::format("<topic>{}{}</topic>", prefix, topic);
  return xml + fmt::format("</topics></{}>\n", verb);
}

std::string topicName(const bus::TopicInfo& info) {
  return std::string(info.name) + (info.name.ends_with('/') ? "*" : "");
}

}  // namespace

std::string governanceXml() {
  return fmt::format(kHead, "governance") +
         fmt::format(
             "<domain_access_rules><domain_rule>\n{}\n"
             "<allow_unauthenticated_participants>false</allow_unauthenticated_participants>\n"
             "<enable_join_access_control>true</enable_join_access_control>\n"
             "<discovery_protection_kind>ENCRYPT</discovery_protection_kind>\n"
             "<liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>\n"
             "<rtps_protection_kind>NONE</rtps_protection_kind>\n"
             "<topic_access_rules><topic_rule>\n<topic_expression>*</topic_expression>\n"
             "<enable_discovery_protection>true</enable_discovery_protection>\n"
             "<enable_liveliness_protection>true</enable_liveliness_protection>\n"
             "<enable_read_access_control>true</enable_read_access_control>\n"
             "<enable_write_access_control>true</enable_write_access_control>\n"
             "<metadata_protection_kind>ENCRYPT</metadata_protection_kind>\n"
             "<data_protection_kind>NONE</data_protection_kind>\n"
             "</topic_rule></topic_access_rules>\n"
             "</domain_rule></domain_access_rules></dds>\n",
             kDomains);
}

Permissions permissionsOf(bus::Role role) {
  Permissions permissions;
  for (const bus::TopicInfo& info : bus::topicTable()) {
    if (info.writers.has(role)) permissions.writes.push_back(topicName(info));
    if (info.readers.has(role)) permissions.reads.push_back(topicName(info));
  }
  return permissions;
}

std::string permissionsXml(const Subject& subject, const std::string& vehicle,
                           const Permissions& permissions, const Validity& validity) {
  const std::string prefix = fmt::format("perdure/{}/", escaped(vehicle));
  return fmt::format(kHead, "permissions") +
         fmt::format(
             "<permissions><grant name=\"{}\">\n<subject_name>{}</subject_name>\n"
             "<validity><not_before>{}</not_before><not_after>{}</not_after></validity>\n"
             "<allow_rule>\n{}\n{}{}</allow_rule>\n<default>DENY</default>\n"
             "</grant></permissions></dds>\n",
             subject.name, subject.text(), timeText(validity.from), timeText(validity.until),
             kDomains, topicsXml("publish", prefix, permissions.writes),
             topicsXml("subscribe", prefix, permissions.reads));
}

}  // namespace perdure::tools
