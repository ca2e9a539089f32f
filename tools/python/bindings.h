// The parts of the module perdure._perdure.
#pragma once

#include <pybind11/pybind11.h>

namespace perdure::python {

void bindBus(pybind11::module_& module);
void bindSubscription(pybind11::module_& module);
/// Reads recordings (MCAP).
void bindRecording(pybind11::module_& module);
/// An inference service with a network in Python. It does the work of services/inference around the
/// network, with the same Health, liveliness and errors.
void bindInferenceService(pybind11::module_& module);

}  // namespace perdure::python
