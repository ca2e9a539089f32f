// An inference service with a network in Python. It does the work of services/inference around the
// network, with the same Health, liveliness and errors.
#pragma once

#include <pybind11/pybind11.h>

namespace perdure::python {

void bindInferenceService(pybind11::module_& module);

}  // namespace perdure::python
