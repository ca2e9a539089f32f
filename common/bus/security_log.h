// Cyclone's messages about refused participants, counted by kind instead of logged each time.
#pragma once

#include <map>
#include <mutex>
#include <set>
#include <string>

#include "common/base/result.h"

namespace perdure::bus {

/// May be used from any thread.
class SecurityLog {
 public:
  /// Takes one message of Cyclone's log. Returns false if it does not concern security.
  bool take(const std::string& message);
  /// Adds security_refused_no_certificate (participants), _unknown_authority, _expired, _revoked,
  /// _certificate (handshakes; a refused participant retries each second), _permissions, _writer
  /// and _reader.
  void report(ReasonCounts& counts) const;
  std::map<std::string, std::string> firstDetails() const;
  /// Returns Cyclone's latest error message about this process's own identity.
  std::string own() const;

 private:
  bool isNewcomer(const std::string& message);

  mutable std::mutex mutex_;
  ReasonCounts counts_;
  std::map<std::string, std::string> first_;
  std::set<std::string> strangers_;
  std::string own_;
};

/// Returns the only log of this process; Cyclone supports a single log sink, which the first call
/// installs. If `discovery`, that call also installs a sink for Cyclone's discovery trace, because
/// only the trace names participants without a certificate.
SecurityLog& securityLog(bool discovery = false);

}  // namespace perdure::bus
