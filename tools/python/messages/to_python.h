// Converts messages to instances of the Python classes, by the description of common/wire. Matrices
// become separate numpy arrays; pixels are not copied. All functions need the GIL.
#pragma once

#include <pybind11/pybind11.h>

#include <string>
#include <typeindex>

namespace perdure::python {

pybind11::object toPython(std::type_index type, const void* message);

/// T: the type of a topic, or a type that a topic's type contains.
template <class T>
pybind11::object toPython(const T& message) {
  return toPython(typeid(T), &message);
}

/// Sets the default values of a struct in an instance of the class with its name.
void setDefaults(const std::string& name, pybind11::handle instance);

}  // namespace perdure::python
