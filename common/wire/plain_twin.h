// Variants of the wire's appendable types in which every struct is final; their memory layout is
// identical.
#pragma once

#include <string>

#include "common/wire/topics.h"

namespace perdure::wire {

/// The twin of a type such as "perdure::msg::Objects". Returns nullptr if the type itself is final,
/// or unknown.
const dds_topic_descriptor_t* plainTwinOf(const std::string& type_name);

}  // namespace perdure::wire
