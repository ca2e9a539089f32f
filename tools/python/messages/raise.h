// Raises Python's exceptions of perdure.errors from C++. All functions need the GIL.
#pragma once

#include <string>

#include "common/base/errors.h"

namespace perdure::python {

/// Raises perdure.errors.`name` with a sentence that contains the fix.
[[noreturn]] void raise(const char* name, const std::string& sentence);

/// To be called once in each module. Converts a StartupError to the exception for its exit status.
void translateStartupErrors();

}  // namespace perdure::python
