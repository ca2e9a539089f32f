// List of networks that are known to work, with their download addresses and properties.
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

/// Classes to report in a kind of scene, and the calibration that was measured there.
struct KnownUse {
  std::string name;  ///< kind of scene: street, room
  std::vector<std::string> classes;
  nlohmann::json calibration;  ///< `calibration` for model.json; null: none was measured
  std::string measured;        ///< data used for the measurement
};

struct KnownNetwork {
  std::string name, maker, licence, family, source, input, classes_file, accuracy;
  std::vector<KnownFile> files;  ///< the first one is the network
  std::vector<KnownUse> uses;
  nlohmann::json keys;  ///< additional keys of model.json
};

/// Returns the networks of `list`, or of the program's own list if `list` is empty. Throws
/// StartupError: 69 if the list is missing, 78 if it is inconsistent.
std::vector<KnownNetwork> knownNetworks(const std::filesystem::path& list);

/// Returns the SHA-256 digest in lower-case hexadecimal. Throws StartupError(kUnavailable) if the
/// file cannot be read.
std::string sha256Of(const std::filesystem::path& file);

std::string describe(const KnownNetwork& network);

}  // namespace perdure::tools
