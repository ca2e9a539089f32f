// Messages as instances of the Python classes, by the description of common/wire: matrices are
// numpy arrays of their own, pixels stay where they lie. All need the GIL.
#pragma once

#include <pybind11/pybind11.h>

#include <string>
#include <typeindex>

namespace perdure::python {

pybind11::object toPython(std::type_index type, const void* message);

/// T: the type of a topic, or one that such a type holds.
template <class T>
pybind11::object toPython(const T& message) {
  return toPython(typeid(T), &message);
}

/// The values of a fresh struct, into an instance of the class that has its name.
void setDefaults(const std::string& name, pybind11::handle instance);

}  // namespace perdure::python
