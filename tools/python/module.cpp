// Module perdure._perdure: the bus and recordings. The public interface is in perdure/*.py.
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "common/vision/jpeg.h"
#include "tools/python/bindings.h"
#include "tools/python/messages/convert.h"
#include "tools/python/messages/message_class.h"
#include "tools/python/messages/raise.h"

namespace {

namespace py = pybind11;
using namespace perdure;

/// Returns the frame with its pixels as an image; decodes JPEG.
py::object unpacked(py::handle packed) {
  const auto frame = python::fromPython<Frame>(packed);
  Result<Frame> image = fail("");
  {
    const py::gil_scoped_release decodes;
    image = vision::decompressed(frame);
  }
  if (!image) python::raise("Refused", "the image cannot be unpacked: " + image.error().code);
  return python::toPython(*image);
}

}  // namespace

PYBIND11_MODULE(_perdure, module) {
  python::translateStartupErrors();
  module.attr("__version__") = PERDURE_VERSION;
  module.def("schema", &python::schema);
  module.def("topic_types", &python::topicTypes);
  module.def("register_class", &python::registerClass);
  module.def("set_defaults", &python::setDefaults);
  module.def("unpacked", &unpacked);
  python::bindBus(module);
  python::bindSubscription(module);
  python::bindRecording(module);
  python::bindInferenceService(module);
}
