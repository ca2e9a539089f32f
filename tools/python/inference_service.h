// An inference service whose network is Python's: what services/inference does around the network,
// with the same Health, liveliness and refusals.
#pragma once

#include <pybind11/pybind11.h>

namespace perdure::python {

void bindInferenceService(pybind11::module_& module);

}  // namespace perdure::python
