// Packed chunks as the recorder's thread receives them, for tests.
#pragma once

#include <random>

#include "tools/record/segment_writer.h"

namespace perdure::tools {

inline CatalogueNow oneChannel() {
  auto catalogue = std::make_shared<replay::mcap::Catalogue>();
  catalogue->schemas[1] = {1, "perdure::msg::ImuSample", "omgidl", "struct ImuSample {};"};
  catalogue->channels[1] = {1, 1, "perdure/ego/imu", "cdr"};
  return catalogue;
}

/// Returns one message of `bytes` incompressible bytes, `seconds` after the start, with one latched
/// message.
inline PackedChunk chunkAt(double seconds, std::size_t bytes = 1000) {
  std::mt19937_64 random(static_cast<std::uint64_t>(1000 * seconds));
  std::vector<std::uint8_t> data(bytes);
  for (auto& byte : data) byte = static_cast<std::uint8_t>(random());
  replay::mcap::Draft draft;
  const auto at = static_cast<std::uint64_t>(1e9 * seconds);
  draft.add(
      {1, static_cast<std::uint32_t>(1000 * seconds), 1'700'000'000'000'000'000 + at, 0, data});
  PackedChunk packed;
  packed.chunk = replay::mcap::pack(draft);
  packed.catalogue = oneChannel();
  packed.latched = std::make_shared<std::vector<Latched>>(std::vector<Latched>{{1, 7, {1, 2, 3}}});
  packed.steady_ns = static_cast<std::int64_t>(at);
  return packed;
}

}  // namespace perdure::tools
