#include "tools/python/messages/raise.h"

#include <pybind11/pybind11.h>

namespace perdure::python {
namespace {

const char* exceptionOf(ExitCode code) {
  switch (code) {
    case ExitCode::kData:
    case ExitCode::kConfiguration:
      return "Unusable";
    case ExitCode::kUnavailable:
    case ExitCode::kInputOutput:
      return "Unavailable";
    default:
      return "Error";
  }
}

pybind11::object classOf(const char* name) {
  return pybind11::module_::import("perdure.errors").attr(name);
}

}  // namespace

void raise(const char* name, const std::string& sentence) {
  PyErr_SetString(classOf(name).ptr(), sentence.c_str());
  throw pybind11::error_already_set();
}

void translateStartupErrors() {
  pybind11::register_local_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const StartupError& error) {
      PyErr_SetString(classOf(exceptionOf(error.code())).ptr(), error.what());
    }
  });
}

}  // namespace perdure::python
