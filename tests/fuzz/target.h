// What is fuzzed: everything that reads bytes from files, recordings and the bus. The same targets
// run under libFuzzer and, for some seconds, as an ordinary test.
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

/// A promise that was not kept: what a reader took is not sound.
struct Broken : std::logic_error {
  using std::logic_error::logic_error;
};
inline void require(bool holds, const std::string& what) {
  if (!holds) throw Broken(what);
}

struct Target {
  std::string name;
  int runs = 1000;                            ///< of the ordinary test
  std::function<std::vector<Bytes>()> seeds;  ///< each is taken
  /// Whether the bytes are taken. What is refused in the way that the reader says (StartupError, a
  /// reason, nothing) gives false; all else that is thrown is a fault.
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

/// What `read` does; false where it throws StartupError.
bool unlessRefused(const std::function<void()>& read);

}  // namespace perdure::fuzz
