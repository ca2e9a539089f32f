// JSON schemas of the gateway's messages: Foxglove's well-known schemas, from their public field
// lists, and Perdure's own.
#pragma once

#include <string>
#include <string_view>

namespace perdure::gateway {

/// Text of the schema of this name, for example "foxglove.Log", which must exist.
std::string jsonSchema(std::string_view name);
/// IDL of foxglove::CompressedImage, which is sent as CDR, because its bytes then need no base64.
std::string compressedImageIdl();

}  // namespace perdure::gateway
