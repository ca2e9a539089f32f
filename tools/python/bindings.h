// Functions that add the parts of the module perdure._perdure.
#pragma once

#include <pybind11/pybind11.h>

namespace perdure::python {

void bindBus(pybind11::module_& module);
void bindSubscription(pybind11::module_& module);
/// Adds the reader of recordings (MCAP).
void bindRecording(pybind11::module_& module);
/// Adds an inference service whose network is in Python; the rest equals services/inference.
void bindInferenceService(pybind11::module_& module);

}  // namespace perdure::python
