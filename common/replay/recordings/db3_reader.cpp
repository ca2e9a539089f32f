// rosbag2's SQLite files: topics(id, name, type, serialization_format, …) and messages(id,
// topic_id, timestamp, data).
#include <sqlite3.h>

#include <algorithm>

#include "common/base/errors.h"
#include "common/base/files/sqlite_file.h"
#include "common/replay/recordings/ros_messages.h"
#include "common/ros/definition.h"

namespace perdure::replay {
namespace {

struct Close {
  void operator()(sqlite3* database) const { sqlite3_close(database); }
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
using Statement = std::unique_ptr<sqlite3_stmt, Close>;

std::string textIn(sqlite3_stmt* row, int column) {
  const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(row, column));
  return text == nullptr ? "" : text;
}

class Db3 : public RosSource {
 public:
  explicit Db3(const std::filesystem::path& path) : path_(path) {
    const OpenedSqlite opened = openSqliteToRead(path);
    database_.reset(opened.connection);
    std::error_code ignored;
    if (std::filesystem::file_size(path, ignored) == 0) refuse("it is empty, 0 bytes");
    const int kind = opened.code & 0xff;
    if (kind == SQLITE_NOTADB || kind == SQLITE_CORRUPT) refuse(opened.why);
    if (kind != SQLITE_OK) throw StartupError(ExitCode::kUnavailable, opened.why);
    readTopics();
    countMessages();
    if (end_ns_ == 0) refuseLeftBehind();
  }

  void rewind(const std::set<std::string>& wanted, std::uint64_t from_ns) override {
    std::string ids;
    for (const auto& [id, name] : names_) {
      if (wanted.contains(name)) ids += (ids.empty() ? "" : ",") + std::to_string(id);
    }
    chosen_ = "SELECT topic_id, timestamp, data, id FROM messages WHERE timestamp >= " +
              std::to_string(static_cast<sqlite3_int64>(from_ns)) + " AND topic_id IN (" + ids +
              ") ORDER BY ";
    rows_ = prepared(chosen_ + "timestamp, id");
    sorted_ = true;
    last_ns_ = -1;
  }

  std::optional<RosMessage> next() override {
    while (step()) {
      const auto log_ns = sqlite3_column_int64(rows_.get(), 1);
      if (sqlite3_column_type(rows_.get(), 1) == SQLITE_INTEGER && log_ns >= last_ns_) {
        last_ns_ = log_ns;
        return message();
      }
      // Times stored as text follow all numbers; a damaged index may give any order.
      count({"stamp_malformed", path_.string() +
                                    ": a message whose time is no whole number, or goes "
                                    "back; it is left out"});
    }
    return std::nullopt;
  }

 private:
  /// Moves to the next row. Returns false at the end.
  bool step() {
    if (!rows_) return false;
    const int got = sqlite3_step(rows_.get());
    if (got == SQLITE_ROW) return true;
    if (got != SQLITE_DONE && sorted_ && last_ns_ < 0) {
      // Sorting failed before its first row. Use the order in which the messages were written.
      sorted_ = false;
      rows_ = prepared(chosen_ + "id");
      return step();
    }
    noteEnd(got);
    rows_.reset();
    return false;
  }

  void noteEnd(int got) {
    if (got == SQLITE_DONE) return;
    const std::string name = path_.string();
    count({"database_damaged", name + ": " + sqlite3_errmsg(database_.get()) +
                                   "; what comes before is read, and `sqlite3 " + name +
                                   " .recover | sqlite3 NEW.db3` may have more of it"});
  }

  RosMessage message() {
    const auto* bytes = static_cast<const std::uint8_t*>(sqlite3_column_blob(rows_.get(), 2));
    const auto size = static_cast<std::size_t>(sqlite3_column_bytes(rows_.get(), 2));
    const auto data = std::make_shared<const std::vector<std::uint8_t>>(bytes, bytes + size);
    return {names_.at(sqlite3_column_int64(rows_.get(), 0)), static_cast<std::uint64_t>(last_ns_),
            static_cast<std::uint64_t>(sqlite3_column_int64(rows_.get(), 3)), *data, data};
  }

  /// Throws StartupError if FILE-wal, to which the recorder writes first, was not copied. Without
  /// it the file of a killed recorder is empty.
  void refuseLeftBehind() const {
    if (!lacksWriteAheadLog(path_)) return;
    throw StartupError(ExitCode::kData,
                       "{0} has no message: it was copied without {1}-wal, which has them; copy "
                       "that file from the recorder's disk, too",
                       path_.string(), path_.filename().string());
  }

  [[noreturn]] void refuse(const std::string& why) const {
    refuseLeftBehind();
    if (sqlite3_errcode(database_.get()) == SQLITE_CORRUPT) {
      throw StartupError(ExitCode::kData, path_.string() + " is damaged (" + why + "); `sqlite3 " +
                                              path_.string() +
                                              " .recover | sqlite3 NEW.db3` may have more of it");
    }
    throw StartupError(ExitCode::kUnavailable,
                       path_.string() + " is no recording of rosbag2 (" + why +
                           "); give the folder or the .db3 that `ros2 bag record` made");
  }

  Statement prepared(const std::string& query) const {
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(database_.get(), query.c_str(), -1, &statement, nullptr) != SQLITE_OK)
      refuse(sqlite3_errmsg(database_.get()));
    return Statement(statement);
  }

  void readTopics() {
    const auto topics = prepared("SELECT id, name, type, serialization_format FROM topics");
    int got = SQLITE_ROW;
    while ((got = sqlite3_step(topics.get())) == SQLITE_ROW) {
      const std::string name = textIn(topics.get(), 1), format = textIn(topics.get(), 3);
      names_[sqlite3_column_int64(topics.get(), 0)] = name;
      topics_[name].type = ros::plainName(textIn(topics.get(), 2));
      if (format != "cdr") topics_[name].type += " in " + (format.empty() ? "no format" : format);
    }
    noteEnd(got);
  }

  /// Counts messages row by row, because an aggregate query returns nothing if a page is damaged.
  void countMessages() {
    const auto rows = prepared("SELECT topic_id, timestamp FROM messages ORDER BY id");
    int got = SQLITE_ROW;
    while ((got = sqlite3_step(rows.get())) == SQLITE_ROW) {
      const auto name = names_.find(sqlite3_column_int64(rows.get(), 0));
      if (name == names_.end()) continue;
      ++topics_[name->second].messages;
      const auto time = sqlite3_column_int64(rows.get(), 1);
      if (sqlite3_column_type(rows.get(), 1) != SQLITE_INTEGER || time < 0) continue;
      const auto log_ns = static_cast<std::uint64_t>(time);
      start_ns_ = std::min(start_ns_, log_ns);
      end_ns_ = std::max(end_ns_, log_ns);
    }
    noteEnd(got);
  }

  std::filesystem::path path_;
  std::unique_ptr<sqlite3, Close> database_;
  std::map<sqlite3_int64, std::string> names_;
  std::string chosen_;  ///< query of the selected messages, without the key of their order
  Statement rows_;
  bool sorted_ = true;
  sqlite3_int64 last_ns_ = -1;
};

}  // namespace

std::unique_ptr<RosSource> openDb3(const std::filesystem::path& file) {
  return std::make_unique<Db3>(file);
}

}  // namespace perdure::replay
