// A PostgreSQL server for tests: in a temporary folder, as an unprivileged user, on 127.0.0.1 and a
// free port.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>

#include "tests/services/map_store/beliefs.h"

namespace perdure::map_store::test {

class PostgresServer {
 public:
  /// The server of this process, which ends with it; null if PostgreSQL is not installed.
  static PostgresServer* get();
  ~PostgresServer();

  /// Whether PostGIS is installed.
  bool hasPostgis() const { return has_postgis_; }
  /// Creates an empty database, with PostGIS if it is installed and requested. Returns its URL with
  /// the administrator's passfile.
  std::string makeDatabase(bool with_postgis = false);
  void dropDatabase(const std::string& url);
  std::string url(const std::string& database) const;
  /// Returns the URL with another port of 127.0.0.1, or with another passfile.
  static std::string through(int port, const std::string& url);
  std::string passfile(const std::string& password) const;
  int port() const { return port_; }

  /// Sends SIGQUIT, as in a crash. Returns when the server has ended.
  void crash();
  /// Returns when the server accepts connections.
  void start();

  /// Runs statements as the administrator.
  void run(const std::string& url, const std::string& sql);
  /// Returns the first number of an answer.
  std::int64_t number(const std::string& url, const std::string& sql);

 private:
  PostgresServer(std::string programs, bool has_postgis);
  void initialise();
  TemporaryFolder folder_;
  std::string programs_;
  bool has_postgis_ = false;
  int port_ = 0, databases_ = 0;
  pid_t process_ = 0;
};

}  // namespace perdure::map_store::test
