// Opens SQLite files of other programs for reading. This is a separate library, because few
// programs use SQLite.
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

/// Opens a file for reading, and waits for at most a second while another program locks the file.
/// In a folder that cannot be written, a file in WAL mode is read as immutable if it has no `-wal`;
/// also under a size limit of files, because SQLite makes a file of 32 KiB beside it.
OpenedSqlite openSqliteToRead(const std::filesystem::path& file);

/// Returns SQLite's message of the last error, with the system's cause of an input or output error.
std::string sqliteError(sqlite3* connection, int code);

/// Returns true if a file is in WAL mode and has no `-wal`. Its newest data may then be missing.
bool lacksWriteAheadLog(const std::filesystem::path& file);

}  // namespace perdure
