// Reads recordings (MCAP) for Python.
#pragma once

#include <pybind11/pybind11.h>

namespace perdure::python {

void bindRecording(pybind11::module_& module);

}  // namespace perdure::python
