// Converts between messages and Python instances by the description of common/wire. Needs the GIL.
#pragma once

#include <pybind11/pybind11.h>

#include <string>
#include <typeindex>

namespace perdure::python {

/// Matrices become separate numpy arrays; pixels are not copied.
pybind11::object toPython(std::type_index type, const void* message);
void fromPython(std::type_index type, pybind11::handle from, void* message);

/// T: the type of a topic, or a type that a topic's type contains.
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

/// Sets the default values of a struct in an instance of the class with its name.
void setDefaults(const std::string& name, pybind11::handle instance);

/// {"Objects": [(name, kind, shape or None, unit, item or None), …], …}: every struct of every
/// topic, after the structs that it contains. Kinds: int, bool, float, str, choice, array, pose,
/// message, optional_message, optional_float, list, names, counts, bytes, pixels. Item: the
/// struct's name, or the words of a choice. The classes, their docstrings and their type hints are
/// generated from it.
pybind11::dict schema();

/// {"objects": "Objects", "frame/": "Frame", …}
pybind11::dict topicTypes();

}  // namespace perdure::python
