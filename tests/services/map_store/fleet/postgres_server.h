// A PostgreSQL server of the tests' own: in a temporary folder, as a user without rights, on
// 127.0.0.1 and a free port.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>

#include "tests/services/map_store/beliefs.h"

namespace perdure::map_store::test {

class PostgresServer {
 public:
  /// Nothing where PostgreSQL is not installed; the one of this process else. It ends with it.
  static PostgresServer* get();
  ~PostgresServer();

  /// Whether PostGIS is installed.
  bool hasPostgis() const { return has_postgis_; }
  /// A new empty database, with PostGIS where it is installed and wanted. Its URL, with the
  /// administrator's passfile.
  std::string makeDatabase(bool with_postgis = false);
  void dropDatabase(const std::string& url);
  std::string url(const std::string& database) const;
  /// Through another port of 127.0.0.1, or with another passfile.
  static std::string through(int port, const std::string& url);
  std::string passfile(const std::string& password) const;
  int port() const { return port_; }

  /// SIGQUIT: as if it had crashed. Returns when it is gone.
  void crash();
  /// Returns when it answers.
  void start();

  /// Runs statements as the administrator.
  void run(const std::string& url, const std::string& sql);
  /// The first number of an answer.
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
