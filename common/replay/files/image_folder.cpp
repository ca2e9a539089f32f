#include "common/replay/files/image_folder.h"

#include <algorithm>
#include <array>

#include "common/replay/files/text_file.h"

namespace perdure::replay {
namespace {

namespace fs = std::filesystem;

}  // namespace

bool isImageName(const fs::path& file) {
  constexpr std::array kEndings{".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm", ".webp"};
  const std::string ending = toLower(file.extension().string());
  return std::find(kEndings.begin(), kEndings.end(), ending) != kEndings.end();
}

ImageFolder::ImageFolder(fs::path folder) : folder_(std::move(folder)) {
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder_, ignored)) {
    const fs::path& file = entry.path();
    if (!fs::exists(file, ignored)) {
      if (dead_links_++ == 0 || file.string() < first_dead_) first_dead_ = file.string();
      continue;
    }
    if (!isImageName(file)) {
      if (!fs::is_directory(file, ignored)) ++other_endings_[file.extension().string()];
      continue;
    }
    // If several files have the same stem, the first in the order of names is used.
    const std::string stem = file.stem().string();
    const auto [form, first] = by_form_.try_emplace(withoutAccents(toLower(stem)), stem);
    if (!first && form->second != stem) form->second.clear();
    std::string& name = by_stem_[stem];
    const std::string other = file.filename().string();
    if (name.empty() || other < name) name = other;
  }
}

std::optional<fs::path> ImageFolder::find(std::string_view name, TimePoint stamp) {
  std::error_code ignored;
  const fs::path written(name);
  if (!name.empty() && fs::is_regular_file(folder_ / written, ignored)) return folder_ / written;
  const std::string last = written.filename().string();
  const auto form = by_form_.find(withoutAccents(toLower(written.stem().string())));
  for (const std::string& stem :
       {last, written.stem().string(), form == by_form_.end() ? "" : form->second,
        std::to_string(toNanoseconds(stamp))}) {
    const auto found = stem.empty() ? by_stem_.end() : by_stem_.find(stem);
    if (found == by_stem_.end()) continue;
    ++found_otherwise_;
    return folder_ / found->second;
  }
  return std::nullopt;
}

std::string ImageFolder::others() const {
  std::error_code ignored;
  if (dead_links_ > 0) {
    return std::to_string(dead_links_) + " links to nothing, the first of them " + first_dead_ +
           " to " + fs::read_symlink(first_dead_, ignored).string() +
           ": copy the images themselves (cp -L, rsync -L)";
  }
  const auto most = std::max_element(other_endings_.begin(), other_endings_.end(),
                                     [](auto& a, auto& b) { return a.second < b.second; });
  if (most == other_endings_.end()) return {};
  const std::string files = std::to_string(most->second) + " files ";
  return files + (most->first.empty() ? "without an ending" : "in " + most->first) +
         ", which is not read: convert them to PNG or JPEG";
}

std::string ImageFolder::first() const {
  return by_stem_.empty() ? std::string() : by_stem_.begin()->second;
}

}  // namespace perdure::replay
