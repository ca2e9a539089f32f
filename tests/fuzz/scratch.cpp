#include "tests/fuzz/scratch.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>

namespace perdure::fuzz {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMark = "=== ";

class Folder {
 public:
  Folder() {
    // The folder is in memory if possible, because a disk is slow for repeated writes of small
    // files.
    const bool memory = std::getenv("TMPDIR") == nullptr && access("/dev/shm", W_OK) == 0;
    const fs::path base = memory ? "/dev/shm" : fs::temp_directory_path();
    std::string name = (base / "perdure-fuzz-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
    path = name;
    setenv("TMPDIR", name.c_str(), 1);
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  fs::path path;
};

void write(const fs::path& file, std::string_view text) {
  std::ofstream(file, std::ios::binary)
      .write(text.data(), static_cast<std::streamsize>(text.size()));
}

/// Returns the text between the marks, by path; the last text counts if a path occurs twice.
std::map<std::string, std::string_view> sections(std::string_view text) {
  std::map<std::string, std::string_view> found;
  while (text.starts_with(kMark)) {
    const std::size_t line = std::min(text.find('\n'), text.size());
    const std::string name(text.substr(kMark.size(), line - kMark.size()));
    text.remove_prefix(std::min(line + 1, text.size()));
    const std::size_t next = text.starts_with(kMark) ? 0 : text.find("\n=== ");
    const std::size_t end = next == 0 ? 0 : std::min(next, text.size() - 1) + 1;
    found[name] = text.substr(0, text.empty() ? 0 : end);
    text.remove_prefix(text.empty() ? 0 : end);
  }
  return found;
}

}  // namespace

const fs::path& scratch() {
  static const Folder folder;
  return folder.path;
}

fs::path asFile(const std::string& name, View bytes) {
  const fs::path file = scratch() / name;
  write(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  return file;
}

Bytes pack(const fs::path& folder, const std::vector<std::string>& files) {
  std::string text;
  for (const auto& name : files) {
    std::ifstream stream(folder / name, std::ios::binary);
    if (!stream) continue;
    text += std::string(kMark) + name + "\n";
    text.append(std::istreambuf_iterator<char>(stream), {});
    if (!text.ends_with('\n')) text += '\n';
  }
  return bytesOf(text);
}

void unpack(View bytes, const fs::path& folder, const std::vector<std::string>& files) {
  const auto found = sections({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  for (const auto& name : files) {
    const auto section = found.find(name);
    if (section == found.end()) {
      fs::remove(folder / name);
    } else {
      write(folder / name, section->second);
    }
  }
}

}  // namespace perdure::fuzz
