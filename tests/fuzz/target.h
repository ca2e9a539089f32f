// Interface of the fuzz targets: all readers of files, recordings and bus messages. The same
// targets run under libFuzzer and, for some seconds, as an ordinary test.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace perdure::fuzz {

using Bytes = std::vector<std::uint8_t>;
using View = std::span<const std::uint8_t>;

/// Thrown if a reader breaks a guarantee, because the data that it accepted are not valid.
struct Broken : std::logic_error {
  using std::logic_error::logic_error;
};
inline void require(bool holds, const std::string& what) {
  if (!holds) throw Broken(what);
}

struct Target {
  std::string name;
  int runs = 1000;                            ///< number of runs in the ordinary test
  std::function<std::vector<Bytes>()> seeds;  ///< `take` accepts each of them
  /// Returns whether the reader accepts the bytes. A regular rejection (StartupError, a reason,
  /// nothing) gives false. Any other exception is a fault.
  std::function<bool(View)> take;
};

const std::vector<Target>& targets();
std::vector<Target> textTargets();
std::vector<Target> folderTargets();
std::vector<Target> settingTargets();
std::vector<Target> binaryTargets();
std::vector<Target> gatewayTargets();
std::vector<Target> mapTargets();
std::vector<Target> rosTargets();
std::vector<Target> vehicleTargets();

inline Bytes bytesOf(std::string_view text) { return {text.begin(), text.end()}; }
inline std::string textOf(View bytes) { return {bytes.begin(), bytes.end()}; }

/// Calls `read`; returns false if it throws StartupError.
bool unlessRefused(const std::function<void()>& read);

}  // namespace perdure::fuzz
