// Module perdure._map: queries to a map file, with the results of `perdure map --db`.
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "tools/map/map_source.h"
#include "tools/python/messages/convert.h"
#include "tools/python/messages/message_class.h"
#include "tools/python/messages/raise.h"

namespace {

namespace py = pybind11;
using namespace perdure;

py::object ask(const std::string& path, py::handle query, bool as_stored) {
  const auto question = python::fromPython<MapQuery>(query);
  MapReply reply;
  {
    const py::gil_scoped_release reads;
    reply = tools::MapFile(path).ask(
        question, as_stored ? tools::MapFrameChoice::kW : tools::MapFrameChoice::kM);
  }
  return python::toPython(reply);
}

}  // namespace

PYBIND11_MODULE(_map, module) {
  python::translateStartupErrors();
  module.def("register_class", &python::registerClass);
  module.def("ask", &ask, py::arg("path"), py::arg("query"), py::arg("as_stored"));
}
