// Raises Python's exceptions of perdure.errors from C++. All functions need the GIL.
#pragma once

#include <string>

#include "common/base/errors.h"

namespace perdure::python {

/// Raises perdure.errors.`name` with a sentence that contains the fix.
[[noreturn]] void raise(const char* name, const std::string& sentence);

/// Converts a StartupError to the exception for its exit status. Call it once in each module.
void translateStartupErrors();

}  // namespace perdure::python
