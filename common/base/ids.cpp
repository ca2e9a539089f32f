#include "common/base/ids.h"

#include <fmt/core.h>

#include <random>

namespace perdure {

InstanceId makeInstanceId() {
  std::random_device device;
  InstanceId id = 0;
  while (id == 0) id = (static_cast<std::uint64_t>(device()) << 32) | device();
  return id;
}

std::uint64_t digest(std::string_view bytes) {
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  for (const char c : bytes) {
    hash ^= static_cast<unsigned char>(c);
    hash *= 0x100000001b3ULL;
  }
  return hash;
}

std::string toHex(std::uint64_t value) { return fmt::format("{:016x}", value); }

}  // namespace perdure
