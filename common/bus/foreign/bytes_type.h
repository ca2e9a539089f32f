// A DDS type that is defined by its name only. Its messages are the serialised bytes. Internal to
// common/bus.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/shared_bytes.h"

struct ddsi_serdata;
struct ddsi_sertype;

namespace perdure::bus {

/// A type without a key, in XCDR1. It matches by name, as ROS types do. The caller owns one
/// reference.
ddsi_sertype* makeBytesType(const std::string& name);

/// A message of such a type; the caller owns one reference. `cdr` includes its header of four
/// bytes.
ddsi_serdata* messageOf(const ddsi_sertype* type, std::vector<std::uint8_t> cdr);
/// The bytes of a message, including the header. They stay valid as long as they have an owner.
SharedBytes bytesOf(const ddsi_serdata* message);

}  // namespace perdure::bus
