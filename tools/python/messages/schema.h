// Describes each struct of common/wire for Python: names, kinds, shapes and units. The classes,
// their docstrings and their type hints are generated from it.
#pragma once

#include <pybind11/pybind11.h>

namespace perdure::python {

/// {"Objects": [(name, kind, shape or None, unit, item or None), …], …}: every struct of every
/// topic, after the structs that it contains. Kinds: int, bool, float, str, choice, array, pose,
/// message, optional_message, optional_float, list, names, counts, bytes, pixels. Item: the
/// struct's name, or the words of a choice.
pybind11::dict schema();

/// {"objects": "Objects", "frame/": "Frame", …}
pybind11::dict topicTypes();

}  // namespace perdure::python
