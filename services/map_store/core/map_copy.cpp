#include "services/map_store/core/map_copy.h"

#include <filesystem>
#include <system_error>

#include "common/base/errors.h"
#include "services/map_store/core/draft_file.h"
#include "services/map_store/core/schema.h"

namespace perdure::map_store {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void cannotRead(const std::string& from, const Reason& reason) {
  const std::string why = " (" + reason.code + ": " + reason.detail + ")";
  if (reason.code == "not_a_database") {
    throw StartupError(ExitCode::kConfiguration,
                       from + " is not a map of Perdure's, or its beginning is damaged" + why +
                           "; give the file that map_store writes (its store.path).");
  }
  if (reason.code == "corrupt") {
    throw StartupError(ExitCode::kUnavailable,
                       "The map " + from + " is damaged" + why +
                           "; give another one. What can be read of it: sqlite3 " + from +
                           " .recover");
  }
  throw StartupError(ExitCode::kUnavailable, "The map " + from + " cannot be read" + why + ".");
}

std::string mendOfWriting(const Reason& reason) {
  if (reason.code == "disk_full") return "free space there, or name a file on another disk.";
  if (reason.code == "io_error") return "look at the disk there, or name a file on another one.";
  return "name a file in a folder that this user may write.";
}

[[noreturn]] void cannotWrite(const std::string& to, const Reason& reason) {
  throw StartupError(exitCodeOf(reason), "The map cannot be copied to " + to + " (" + reason.code +
                                             ": " + reason.detail + "); " + mendOfWriting(reason));
}

Connection openSource(const std::string& from) {
  if (!fs::exists(from)) {
    throw StartupError(
        ExitCode::kUnavailable,
        "There is no map " + from + "; give the file that map_store writes (its store.path).");
  }
  auto connection = Connection::open(from, Connection::Mode::kReadOnly);
  if (!connection) cannotRead(from, connection.error());
  const auto identity = identityOf(*connection);
  if (!identity) cannotRead(from, identity.error());
  if (identity->application != kApplicationId) {
    throw StartupError(ExitCode::kConfiguration,
                       from +
                           " is not a map of Perdure's; give the file that map_store writes "
                           "(its store.path).");
  }
  if (identity->version > kSchemaVersion) {
    throw StartupError(ExitCode::kConfiguration,
                       "The map " + from + " has schema " + std::to_string(identity->version) +
                           ", this program knows up to " + std::to_string(kSchemaVersion) +
                           "; use the newer Perdure, or give another map.");
  }
  return *std::move(connection);
}

/// Refuses remaining files: SQLite would take the log of another database for the copy's.
void refuseWhatIsThere(const std::string& to) {
  const auto refuse = [](const std::string& file) {
    if (!fs::exists(fs::symlink_status(file))) return;
    throw StartupError(ExitCode::kConfiguration,
                       file +
                           " is there already and is not overwritten; remove it, or name "
                           "another file for the new map.");
  };
  refuse(to);
  for (const char* suffix : kBeside) refuse(to + suffix);
}

/// Closes the draft, so that all data is in one file.
void writeDraft(const std::string& from, const std::string& to, const DraftFile& draft) {
  const Connection source = openSource(from);
  const auto target = Connection::open(draft.path(), Connection::Mode::kReadWriteCreate);
  if (!target) cannotWrite(to, target.error());
  const auto copied = source.copyInto(*target);
  const auto damaged = [](const Reason& reason) {
    return reason.code == "corrupt" || reason.code == "not_a_database";
  };
  if (!copied && damaged(copied.error())) cannotRead(from, copied.error());
  if (!copied) cannotWrite(to, copied.error());
  const auto sound = wholeFileIsSound(*target);
  if (!sound && damaged(sound.error())) cannotRead(from, sound.error());
  if (!sound) cannotWrite(to, sound.error());
}

}  // namespace

void copyMap(const std::string& from, const std::string& to) {
  const fs::path folder = fs::absolute(to).parent_path();
  std::error_code error;
  refuseWhatIsThere(to);
  (void)openSource(from);
  fs::create_directories(folder, error);
  if (error) cannotWrite(to, {"cannot_open", folder.string() + ": " + error.message()});
  const DraftFile draft(to);
  writeDraft(from, to, draft);
  if (!sync(draft.path())) cannotWrite(to, {"io_error", "it cannot be synced"});
  fs::rename(draft.path(), to, error);
  if (error) cannotWrite(to, {"io_error", error.message()});
  (void)sync(folder);  // not every file system can sync a folder
}

}  // namespace perdure::map_store
