#include "services/gateway/web/files.h"

#include <fstream>
#include <iterator>

#include "common/base/errors.h"
#include "common/base/ids.h"

namespace perdure::gateway::web {
namespace {

namespace fs = std::filesystem;
constexpr std::uintmax_t kMostBytes = 64U << 20U;

std::string typeOf(const fs::path& file) {
  static const std::map<std::string, std::string> kTypes = {
      {".html", "text/html; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".json", "application/json"},
      {".svg", "image/svg+xml"},
      {".png", "image/png"},
      {".txt", "text/plain; charset=utf-8"}};
  const auto found = kTypes.find(file.extension().string());
  return found == kTypes.end() ? "application/octet-stream" : found->second;
}

std::string contentOf(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::string content{std::istreambuf_iterator<char>(stream), {}};
  if (!stream) {
    throw StartupError(ExitCode::kUnavailable,
                       file.string() + " cannot be read; set page.folder to the built page");
  }
  return content;
}

}  // namespace

Files::Files(const fs::path& folder) {
  std::error_code error;
  if (!fs::exists(folder / "index.html", error)) return;
  std::uintmax_t bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file() || entry.path().extension() == ".gz") continue;
    bytes += entry.file_size();
    if (bytes > kMostBytes) {
      throw StartupError(ExitCode::kUnavailable, folder.string() +
                                                     " holds more than 64 MiB, which no page of "
                                                     "this gateway does; fix page.folder");
    }
    auto file = std::make_shared<File>();
    file->type = typeOf(entry.path());
    file->content = contentOf(entry.path());
    file->tag = '"' + toHex(digest(file->content)) + '"';
    const fs::path packed = entry.path().string() + ".gz";
    if (fs::exists(packed)) file->packed = contentOf(packed);
    files_["/" + fs::relative(entry.path(), folder).generic_string()] = std::move(file);
  }
}

std::shared_ptr<const File> Files::find(std::string_view path) const {
  const auto found = files_.find(path == "/" ? std::string_view("/index.html") : path);
  return found == files_.end() ? nullptr : found->second;
}

void Files::replaceIn(const std::string& path, const std::string& from, const std::string& to) {
  const auto found = files_.find(path);
  if (found == files_.end() || from == to) return;
  auto changed = std::make_shared<File>(*found->second);
  std::string& text = changed->content;
  for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
  changed->packed.clear();  // the compressed copy belongs to the previous content
  changed->tag = '"' + toHex(digest(text)) + '"';
  found->second = std::move(changed);
}

fs::path usualPageFolder() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  // The program is bin/perdure-gateway or libexec/perdure/play.
  fs::path page;
  for (fs::path up = program.parent_path(); up.has_relative_path(); up = up.parent_path()) {
    page = up / "share" / "perdure" / "viewer";
    if (fs::exists(page, error)) break;
  }
  return page;
}

}  // namespace perdure::gateway::web
