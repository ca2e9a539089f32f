#include "common/base/check.h"

#include <cstdio>
#include <cstdlib>

namespace perdure {

void failCheck(std::string_view what, const std::source_location& where) {
  std::fprintf(stderr, "%s:%u: %s: must hold: %.*s\n", where.file_name(), where.line(),
               where.function_name(), static_cast<int>(what.size()), what.data());
  std::abort();
}

}  // namespace perdure
