// Python's exceptions of perdure.errors, raised from C++. All need the GIL.
#pragma once

#include <string>

#include "common/base/errors.h"

namespace perdure::python {

/// Raises perdure.errors.`name` with a sentence that says the mend.
[[noreturn]] void raise(const char* name, const std::string& sentence);

/// Once a module: a StartupError becomes the exception that its exit status stands for.
void translateStartupErrors();

}  // namespace perdure::python
