#include "common/base/files/sqlite_file.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <array>
#include <cstring>
#include <fstream>

#include "common/base/checked_file.h"
#include "common/base/files/access.h"
#include "common/base/files/folder_lock.h"

namespace perdure {
namespace {

namespace fs = std::filesystem;

/// Returns the URI of a file for SQLite. `options` is empty or begins with a question mark.
std::string addressOf(const fs::path& file, const char* options) {
  std::string address = "file://";
  for (const char c : fs::absolute(file).string()) {
    const bool special = c == '%' || c == '?' || c == '#';
    address += special ? fmt::format("%{:02X}", static_cast<unsigned char>(c)) : std::string(1, c);
  }
  return address + options;
}

int openAs(const std::string& name, sqlite3*& connection) {
  constexpr int kFlags = SQLITE_OPEN_READONLY | SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_URI;
  sqlite3_close(connection);
  if (const int code = sqlite3_open_v2(name.c_str(), &connection, kFlags, nullptr)) return code;
  sqlite3_extended_result_codes(connection, 1);
  sqlite3_busy_timeout(connection, 1000);
  // SQLite reads the file only at the first statement, so errors appear here.
  return sqlite3_exec(connection, "PRAGMA schema_version", nullptr, nullptr, nullptr);
}

bool holds(const fs::path& file, const char* suffix) {
  std::error_code missing;
  const auto size = fs::file_size(file.string() + suffix, missing);
  return !missing && size > 0;
}

std::string whyNot(const fs::path& file, int code, const std::string& of_sqlite) {
  if (std::string why = whyUnreadable(file); !why.empty()) return why;
  const int kind = code & 0xff;
  if (kind == SQLITE_BUSY || kind == SQLITE_LOCKED) {
    return file.string() + " is locked by another program" + lockerOf(file) +
           "; end it, or read a copy";
  }
  for (const char* suffix : {"-wal", "-journal"}) {
    const bool wants_to_write = kind == SQLITE_READONLY || kind == SQLITE_CANTOPEN;
    if (!wants_to_write || !holds(file, suffix)) continue;
    return fmt::format(
        "{0} has unfinished changes in {0}{1}, which can be read only in a folder that this user "
        "may write; copy both files to one",
        file.string(), suffix);
  }
  return file.string() + ": " + of_sqlite;
}

/// Returns the target of a link, because SQLite stores `-wal` beside the target.
fs::path targetOf(const fs::path& link) {
  std::error_code missing;
  const fs::path target = fs::canonical(link, missing);
  return missing ? link : target;
}

}  // namespace

std::string sqliteError(sqlite3* connection, int code) {
  std::string text = connection != nullptr ? sqlite3_errmsg(connection) : sqlite3_errstr(code);
  if ((code & 0xff) != SQLITE_IOERR) return text;
  const int cause = connection != nullptr ? sqlite3_system_errno(connection) : 0;
  if (cause != 0) text += std::string(": ") + std::strerror(cause);
  // SQLite does not keep the system's cause of each error.
  if (const auto limit = fileSizeLimit())
    text += fmt::format("; files are limited to {} bytes (ulimit -f)", *limit);
  return text;
}

OpenedSqlite openSqliteToRead(const fs::path& link) {
  const fs::path file = targetOf(link);
  OpenedSqlite opened;
  opened.code = openAs(addressOf(file, ""), opened.connection);
  const int kind = opened.code & 0xff;
  const bool wants_to_write =
      kind == SQLITE_READONLY || kind == SQLITE_CANTOPEN || kind == SQLITE_IOERR;
  if (wants_to_write && !holds(file, "-wal") && !holds(file, "-journal")) {
    opened.code = openAs(addressOf(file, "?immutable=1"), opened.connection);
  }
  if (opened.code != 0)
    opened.why = whyNot(file, opened.code, sqliteError(opened.connection, opened.code));
  return opened;
}

bool lacksWriteAheadLog(const fs::path& link) {
  const fs::path file = targetOf(link);
  constexpr std::size_t kWriteVersion = 18;  // offset in the header; the value 2 is WAL mode
  std::array<char, kWriteVersion + 1> head{};
  std::ifstream(file, std::ios::binary).read(head.data(), head.size());
  return head[kWriteVersion] == 2 && !holds(file, "-wal");
}

}  // namespace perdure
