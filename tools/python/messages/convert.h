// Converts messages to and from Python instances as described in common/types. Needs the GIL.
#pragma once

#include <pybind11/pybind11.h>

#include <string>
#include <typeindex>

namespace perdure::python {

/// Converts a message to Python. Matrices become separate numpy arrays; pixels are not copied.
pybind11::object toPython(std::type_index type, const void* message);
void fromPython(std::type_index type, pybind11::handle from, void* message);

/// T: the type of a topic, or a type in the description of a topic's type.
template <class T>
pybind11::object toPython(const T& message) {
  return toPython(typeid(T), &message);
}
/// T: the type of a topic.
template <class T>
T fromPython(pybind11::handle from) {
  T message;
  fromPython(typeid(T), from, &message);
  return message;
}

/// Sets the default values of the struct `name` in an instance of its Python class.
void setDefaults(const std::string& name, pybind11::handle instance);

/// {"Objects": [(name, kind, shape or None, unit, item or None), …], …}: every struct of every
/// topic, after the structs that it contains. Kinds: int, bool, float, str, choice, array, pose,
/// message, optional_message, optional_float, list, names, counts, bytes, pixels. Item: the
/// struct's name, or the words of a choice. The classes with their docstrings and type hints are
/// generated from this.
pybind11::dict schema();

/// The type of each topic: {"objects": "Objects", "frame/": "Frame", …}
pybind11::dict topicTypes();

}  // namespace perdure::python
