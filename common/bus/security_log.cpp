#include "common/bus/security_log.h"

#include <array>
#include <cstdio>
#include <string_view>

#include "common/bus/dds.h"

namespace perdure::bus {
namespace {

struct Kind {
  const char* says;
  const char* count;
};
/// Parts of Cyclone 0.10.2's messages, and the count of each. The first match applies.
constexpr std::array kKinds{
    Kind{"Non secure remote ", "no_certificate"},
    Kind{"unable to get local issuer certificate", "unknown_authority"},
    Kind{"certificate has expired", "expired"},
    Kind{"certificate revoked", "revoked"},
    Kind{"Certificate not valid", "certificate"},
    Kind{"handshake reply failed", "certificate"},
    Kind{"handshake request failed", "certificate"},
    Kind{"Process handshake failed", "certificate"},
    Kind{"permissions from plugin", "permissions"},
    Kind{"does not allow remote writer", "writer"},
    Kind{"does not allow remote topic", "writer"},
    Kind{"does not allow remote reader", "reader"},
};
/// Parts of the messages about this process's own identity.
constexpr std::array kOwn{"validating local", "Local topic permission denied",
                          "validate local identity", "Could not load security"};
/// Part of a message that is ignored: the process is about to end, or was refused already.
constexpr const char* kNothing = "Remote secure participant ";

bool contains(const std::string& text, const char* words) {
  return text.find(words) != std::string::npos;
}

std::string oneLine(std::string text) {
  for (char& c : text) c = c == '\n' ? ' ' : c;
  while (text.ends_with(' ')) text.pop_back();
  return text;
}

void takeLog(void* log, const dds_log_data_t* data) {
  const std::string message(data->message, data->size);
  if (!static_cast<SecurityLog*>(log)->take(message)) {
    std::fprintf(stderr, "DDS: %s\n", oneLine(message).c_str());
  }
}

void takeTrace(void* log, const dds_log_data_t* data) {
  constexpr std::uint32_t kLogged = DDS_LC_FATAL | DDS_LC_ERROR | DDS_LC_WARNING | DDS_LC_INFO;
  if ((data->priority & kLogged) != 0) return;  // the other log sink receives this message
  (void)static_cast<SecurityLog*>(log)->take({data->message, data->size});
}

}  // namespace

/// Returns true for the first message about a participant. A participant counts once, although each
/// of its endpoints is refused repeatedly.
bool SecurityLog::isNewcomer(const std::string& message) {
  constexpr std::size_t kMost = 1024;
  constexpr std::string_view kBefore = "remote writer ";  // "remote reader " has the same length
  const auto begin = message.find("remote ") + kBefore.size();
  const auto end = message.rfind(':', message.find(' ', begin));  // end of the participant's GUID
  if (end == std::string::npos || end <= begin) return false;
  if (strangers_.size() >= kMost) strangers_.clear();
  return strangers_.insert(message.substr(begin, end - begin)).second;
}

bool SecurityLog::take(const std::string& message) {
  const std::lock_guard lock(mutex_);
  for (const char* words : kOwn) {
    if (!contains(message, words)) continue;
    own_ = oneLine(message);
    return true;
  }
  if (contains(message, kNothing)) return true;
  for (const Kind& kind : kKinds) {
    if (!contains(message, kind.says)) continue;
    if (&kind == &kKinds.front() && !isNewcomer(message)) return true;
    const std::string name = std::string("security_refused_") + kind.count;
    counts_.add(name);
    first_.emplace(name, oneLine(message));
    return true;
  }
  return false;
}

void SecurityLog::report(ReasonCounts& counts) const {
  const std::lock_guard lock(mutex_);
  counts.add(counts_);
}

std::map<std::string, std::string> SecurityLog::firstDetails() const {
  const std::lock_guard lock(mutex_);
  return first_;
}

std::string SecurityLog::own() const {
  const std::lock_guard lock(mutex_);
  return own_;
}

SecurityLog& securityLog(bool discovery) {
  static SecurityLog* const log = [discovery] {
    auto* made = new SecurityLog;  // never deleted: Cyclone's threads may log until exit
    dds_set_log_sink(&takeLog, made);
    if (discovery) dds_set_trace_sink(&takeTrace, made);
    return made;
  }();
  return *log;
}

}  // namespace perdure::bus
