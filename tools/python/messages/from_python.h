// Converts instances of the Python classes to messages. Kinds and shapes are checked here, bounds
// by the encoder. Raises perdure.Refused with the path of the field. Needs the GIL.
#pragma once

#include <pybind11/pybind11.h>

#include <typeindex>

namespace perdure::python {

void fromPython(std::type_index type, pybind11::handle from, void* message);

/// T: the type of a topic.
template <class T>
T fromPython(pybind11::handle from) {
  T message;
  fromPython(typeid(T), from, &message);
  return message;
}

}  // namespace perdure::python
