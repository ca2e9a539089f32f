// What Cyclone says of those whom security shut out: counted by kind instead of logged each time.
#pragma once

#include <map>
#include <mutex>
#include <set>
#include <string>

#include "common/base/result.h"

namespace perdure::bus {

/// From any thread.
class SecurityLog {
 public:
  /// One message of Cyclone's log. False where it is none of security.
  bool take(const std::string& message);
  /// Adds security_refused_no_certificate (participants), _unknown_authority, _expired, _revoked,
  /// _certificate (handshakes; who is refused tries again each second), _permissions, _writer,
  /// _reader.
  void report(ReasonCounts& counts) const;
  /// The first message of each kind.
  std::map<std::string, std::string> firstDetails() const;
  /// The latest thing that was wrong with this process's own identity.
  std::string own() const;

 private:
  bool isNewcomer(const std::string& message);

  mutable std::mutex mutex_;
  ReasonCounts counts_;
  std::map<std::string, std::string> first_;
  std::set<std::string> strangers_;
  std::string own_;
};

/// Of this process: Cyclone's log has one sink. The first call sets it; `discovery` takes Cyclone's
/// trace of discovery too, which is the only place where it names those without a certificate.
SecurityLog& securityLog(bool discovery = false);

}  // namespace perdure::bus
