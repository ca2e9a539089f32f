// The images of a camera's folder, found by what a list calls them.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/time.h"

namespace perdure::replay {

/// By its ending.
bool isImageName(const std::filesystem::path& file);

class ImageFolder {
 public:
  explicit ImageFolder(std::filesystem::path folder);

  /// The image that is meant: by its name; else by the last part of the name, with another ending
  /// or none; else by the stamp. Nothing where there is none.
  std::optional<std::filesystem::path> find(std::string_view name, TimePoint stamp);
  /// Images that are there, by their endings.
  std::size_t size() const { return by_stem_.size(); }
  /// The first one's name; "" where there is none.
  std::string first() const;
  /// Why it may hold no image: links to nothing, or files of other endings; "" where it has
  /// neither.
  std::string others() const;
  /// How many were found, but not by the name as it is written.
  std::size_t foundOtherwise() const { return found_otherwise_; }

 private:
  std::filesystem::path folder_;
  std::map<std::string, std::string, std::less<>> by_stem_;  ///< names
  std::map<std::string, std::size_t> other_endings_;
  std::size_t dead_links_ = 0;
  std::string first_dead_;
  std::size_t found_otherwise_ = 0;
};

}  // namespace perdure::replay
