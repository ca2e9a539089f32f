// The parts of the module perdure._perdure.
#pragma once

#include <pybind11/pybind11.h>

namespace perdure::python {

void bindBus(pybind11::module_& module);
void bindSubscription(pybind11::module_& module);
/// Reads recordings (MCAP).
void bindRecording(pybind11::module_& module);
/// An inference service with a network in Python, as services/inference otherwise.
void bindInferenceService(pybind11::module_& module);

}  // namespace perdure::python
