// A type of which DDS knows the name alone: its messages are bytes, as they are on the wire.
// Internal to common/bus.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/shared_bytes.h"

struct ddsi_serdata;
struct ddsi_sertype;

namespace perdure::bus {

/// Without a key, in XCDR1; it matches by its name, as types of ROS do. The caller owns one
/// reference.
ddsi_sertype* makeBytesType(const std::string& name);

/// A message of such a type; the caller owns one reference. `cdr` with its head of four bytes.
ddsi_serdata* messageOf(const ddsi_sertype* type, std::vector<std::uint8_t> cdr);
/// The bytes of a message, head and all, which stay as long as they are held.
SharedBytes bytesOf(const ddsi_serdata* message);

}  // namespace perdure::bus
