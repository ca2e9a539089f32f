// Raises the Python exceptions of perdure.errors from C++. All functions need the GIL.
#pragma once

#include <string>

#include "common/base/errors.h"

namespace perdure::python {

/// Raises perdure.errors.`name`; `sentence` states the cause and the fix.
[[noreturn]] void raise(const char* name, const std::string& sentence);

/// Makes StartupError raise the Python exception of its exit status. Call this once per module.
void translateStartupErrors();

}  // namespace perdure::python
