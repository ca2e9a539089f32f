#include "services/map_store/core/map_copy.h"

#include <filesystem>
#include <system_error>

#include "common/base/errors.h"
#include "services/map_store/core/draft_file.h"
#include "services/map_store/core/schema.h"

namespace perdure::map_store {
namespace {

namespace fs = std::filesystem;

/// Throws if `to` or a file of SQLite beside it exists, because SQLite would apply the log of
/// another database to the copy.
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

/// Copies the map to the draft and closes it, so that all data is in one file.
void writeDraft(const std::string& from, const std::string& to, const DraftFile& draft) {
  const Connection source = openStoreForReading(from);
  const auto target = Connection::open(draft.path(), Connection::Mode::kReadWriteCreate);
  if (!target) cannotWriteMap(to, target.error());
  const auto copied = source.copyInto(*target);
  if (!copied && isDamage(copied.error())) cannotReadMap(from, copied.error());
  if (!copied) cannotWriteMap(to, copied.error());
  const auto sound = wholeFileIsSound(*target);
  if (!sound && isDamage(sound.error())) cannotReadMap(from, sound.error());
  if (!sound) cannotWriteMap(to, sound.error());
}

}  // namespace

void copyMap(const std::string& from, const std::string& to) {
  const fs::path folder = fs::absolute(to).parent_path();
  std::error_code error;
  refuseWhatIsThere(to);
  (void)openStoreForReading(from);
  fs::create_directories(folder, error);
  if (error) cannotWriteMap(to, {"cannot_open", folder.string() + ": " + error.message()});
  const DraftFile draft(to);
  writeDraft(from, to, draft);
  draft.keep();
}

}  // namespace perdure::map_store
