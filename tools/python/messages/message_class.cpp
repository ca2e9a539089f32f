#include "tools/python/messages/message_class.h"

#include <map>

#include "tools/python/messages/raise.h"

namespace perdure::python {

namespace py = pybind11;

py::object MessageClass::make() const {
  if (type == nullptr) raise("Error", "import perdure before " + name + " is used");
  static PyObject* const kNothing = PyTuple_New(0);
  return py::reinterpret_steal<py::object>(
      type->tp_new(type, kNothing, nullptr));  // without a call of __init__
}

bool MessageClass::isOne(py::handle object) const {
  return type != nullptr && PyObject_TypeCheck(object.ptr(), type);
}

MessageClass& messageClass(const std::string& name) {
  static auto& classes = *new std::map<std::string, MessageClass>;  // never deleted
  MessageClass& it = classes[name];
  it.name = name;
  return it;
}

void registerClass(const std::string& name, py::type type, const std::vector<std::string>& fields) {
  MessageClass& it = messageClass(name);
  it.fields.clear();
  for (const std::string& field : fields) {
    it.fields.push_back(PyUnicode_InternFromString(field.c_str()));
  }
  it.type = reinterpret_cast<PyTypeObject*>(type.release().ptr());
}

}  // namespace perdure::python
