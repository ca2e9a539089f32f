// Opens SQLite files of others to read them. A library of its own, because few programs use SQLite.
#pragma once

#include <filesystem>
#include <string>

struct sqlite3;

namespace perdure {

struct OpenedSqlite {
  sqlite3* connection = nullptr;  ///< to be closed by the caller, also after a failure
  int code = 0;                   ///< SQLite's error code; 0: the file can be read
  std::string why;                ///< after a failure: the cause and its fix
};

/// Opens a file to read it, and waits at most a second while another program locks it. A file in
/// WAL mode in a folder that cannot be written is read as immutable if it has no `-wal`.
OpenedSqlite openSqliteToRead(const std::filesystem::path& file);

/// Whether a file in WAL mode has no `-wal`, so its newest data may have been left behind.
bool lacksWriteAheadLog(const std::filesystem::path& file);

}  // namespace perdure
