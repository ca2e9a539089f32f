// The twins of the wire's appendable types in which every struct is final: the same in memory.
#pragma once

#include <string>

#include "common/wire/description/types.h"

namespace perdure::wire {

/// Of "perdure::msg::Objects", …; nullptr where the type is final itself, or unknown.
const dds_topic_descriptor_t* plainTwinOf(const std::string& type_name);

}  // namespace perdure::wire
