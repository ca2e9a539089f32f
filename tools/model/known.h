// Networks that are known to work: where their files are, and what is known of each.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace perdure::tools {

struct KnownFile {
  std::string name, url, sha256;
  std::uint64_t bytes = 0;
};

/// What is reported of a place of a kind, and the calibration that was measured there.
struct KnownUse {
  std::string name;  ///< street, room
  std::vector<std::string> classes;
  nlohmann::json calibration;  ///< of model.json; null where none was measured
  std::string measured;        ///< on what
};

struct KnownNetwork {
  std::string name, maker, licence, family, source, input, classes_file, accuracy;
  std::vector<KnownFile> files;  ///< the first is the network
  std::vector<KnownUse> uses;
  nlohmann::json keys;  ///< further ones of model.json
};

/// Those of `list`; of the program's own where it is empty. Throws StartupError where it is missing
/// (69) or at odds with itself (78).
std::vector<KnownNetwork> knownNetworks(const std::filesystem::path& list);

/// Lower-case hexadecimal. Throws StartupError(kUnavailable) where it cannot be read.
std::string sha256Of(const std::filesystem::path& file);

/// A few lines for people.
std::string describe(const KnownNetwork& network);

}  // namespace perdure::tools
