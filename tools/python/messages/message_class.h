// The Python classes of messages, which perdure/messages.py registers. Needs the GIL.
#pragma once

#include <cxxabi.h>
#include <pybind11/pybind11.h>

#include <cstdlib>
#include <memory>
#include <string>
#include <typeinfo>
#include <vector>

namespace perdure::python {

struct MessageClass {
  std::string name;               ///< struct name, such as "ObjectBelief"
  PyTypeObject* type = nullptr;   ///< never released
  std::vector<PyObject*> fields;  ///< interned, in the order of the description

  /// Creates an instance without values. Raises an error if the class is not registered.
  pybind11::object make() const;
  bool isOne(pybind11::handle object) const;
};

/// Returns the class of this name, which is created on the first call.
MessageClass& messageClass(const std::string& name);
void registerClass(const std::string& name, pybind11::type type,
                   const std::vector<std::string>& fields);

/// Name of a type without its namespace: perdure::ObjectBelief → "ObjectBelief".
template <class D>
const std::string& nameOfType() {
  static const std::string name = [] {
    int status = 0;
    const std::unique_ptr<char, decltype(&std::free)> full(
        abi::__cxa_demangle(typeid(D).name(), nullptr, nullptr, &status), &std::free);
    const std::string text = full ? full.get() : typeid(D).name();
    return text.substr(text.rfind(':') + 1);
  }();
  return name;
}

template <class D>
MessageClass& messageClass() {
  static MessageClass& it = messageClass(nameOfType<D>());
  return it;
}

}  // namespace perdure::python
