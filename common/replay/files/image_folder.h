// The images in a camera's folder, found by the names in a list.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/time.h"

namespace perdure::replay {

/// Returns whether a file has the extension of an image.
bool isImageName(const std::filesystem::path& file);

class ImageFolder {
 public:
  explicit ImageFolder(std::filesystem::path folder);

  /// Finds an image by its path in the list; otherwise by its file name with another extension or
  /// none, in other case or Unicode form; otherwise by the stamp. Returns nothing if no image
  /// matches.
  std::optional<std::filesystem::path> find(std::string_view name, TimePoint stamp);
  /// Number of images, recognised by their extensions.
  std::size_t size() const { return by_stem_.size(); }
  /// Name of the first image. Returns "" if there is none.
  std::string first() const;
  /// Describes the other contents of a folder without images: broken links, or files with other
  /// extensions. Returns "" if it has neither.
  std::string others() const;
  /// Number of images that find() found by another name than the one in the list.
  std::size_t foundOtherwise() const { return found_otherwise_; }

 private:
  std::filesystem::path folder_;
  std::map<std::string, std::string, std::less<>> by_stem_;  ///< file names by stem
  std::map<std::string, std::string>
      by_form_;  ///< stems by their form in lower case without accents; "" if ambiguous
  std::map<std::string, std::size_t> other_endings_;
  std::size_t dead_links_ = 0;
  std::string first_dead_;
  std::size_t found_otherwise_ = 0;
};

}  // namespace perdure::replay
