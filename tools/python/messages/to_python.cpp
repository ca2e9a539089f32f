#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <map>

#include "tools/python/messages/choices.h"
#include "tools/python/messages/convert.h"
#include "tools/python/messages/fields.h"
#include "tools/python/messages/message_class.h"

namespace perdure::python {
namespace {

namespace py = pybind11;

template <class X>
py::object objectOf(const X& value) {
  return py::cast(value);
}
py::object objectOf(const TimePoint& time) { return py::int_(toNanoseconds(time)); }
template <class M>
requires(M::RowsAtCompileTime > 0) py::object objectOf(const M& m) {
  constexpr int kRows = M::RowsAtCompileTime, kCols = M::ColsAtCompileTime;
  using X = typename M::Scalar;
  using RowMajor =
      Eigen::Matrix<X, kRows, kCols, kCols == 1 ? int{Eigen::ColMajor} : int{Eigen::RowMajor}>;
  py::array_t<X> array = kCols == 1 ? py::array_t<X>(kRows) : py::array_t<X>({kRows, kCols});
  Eigen::Map<RowMajor>(array.mutable_data()) = m;
  return array;
}
template <std::floating_point X>
py::object objectOf(const std::vector<X>& numbers) {
  return py::array_t<X>(static_cast<py::ssize_t>(numbers.size()), numbers.data());
}
template <std::size_t N>
py::object objectOf(const std::array<std::uint8_t, N>& bytes) {
  return py::array_t<std::uint8_t>(static_cast<py::ssize_t>(N), bytes.data());
}

/// A read-only array over the frame's pixels, which live as long as the array.
py::object pixelsOf(const Frame& frame) {
  if (!frame.data) return py::none();
  const auto bytes = *frame.data;
  const py::capsule keeper(new SharedBytes(frame.data),
                           [](void* kept) { delete static_cast<SharedBytes*>(kept); });
  std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(bytes.size())};
  if (!isCompressed(frame.encoding)) {
    shape = {frame.height, frame.width};
    if (channelsOf(frame.encoding) > 1) shape.push_back(channelsOf(frame.encoding));
  }
  py::array_t<std::uint8_t> array(shape, bytes.data(), keeper);
  array.attr("flags").attr("writeable") = false;
  return array;
}

class Giver : public EachField<Giver> {
 public:
  Giver(const MessageClass& type, py::handle self) : type_(type), self_(self) {}

  void field(const char*, const auto& d, const auto&) { set(objectOf(d)); }
  void field(const char*, const RigidTransform& d, const auto&) {
    static const MessageClass* const type = &messageClass("Pose");
    py::object pose = type->make();
    Giver giver(*type, pose);
    giver.set(objectOf(Eigen::Vector4d(d.q.coeffs())));
    giver.set(objectOf(d.p));
    set(std::move(pose));
  }
  template <class E, class W>
  void choice(const char*, const E& d, W&, E) {
    const auto word = wordOf(d);
    if (word.empty()) return set(py::int_(static_cast<int>(d)));
    set(py::str(word.data(), word.size()));
  }
  template <class D, class W>
  void object(const char*, const D& d, W& w) {
    set(nested(d, w));
  }
  template <class D, class W>
  void optional(const char*, const std::optional<D>& d, bool, W& w) {
    set(d ? nested(*d, w) : py::object(py::none()));
  }
  template <class D, class S>
  void list(const char*, const std::vector<D>& d, S&, std::size_t) {
    std::remove_pointer_t<decltype(S::_buffer)> unused{};
    py::list items(d.size());
    for (std::size_t i = 0; i < d.size(); ++i) {
      PyList_SET_ITEM(items.ptr(), static_cast<py::ssize_t>(i),
                      nested(d[i], unused).release().ptr());
    }
    set(std::move(items));
  }
  void pixels(const char*, const Frame& d, perdure_msg_Frame&) { set(pixelsOf(d)); }

  template <class D, class W>
  static py::object nested(const D& d, W& w) {
    const MessageClass& type = messageClass<D>();
    py::object self = type.make();
    Giver giver(type, self);
    wire::describe(giver, d, w);
    return self;
  }

 private:
  void set(const py::object& value) {
    if (PyObject_SetAttr(self_.ptr(), type_.fields[next_++], value.ptr()) != 0) {
      throw py::error_already_set();
    }
  }

  const MessageClass& type_;
  py::handle self_;
  std::size_t next_ = 0;
};

struct Conversion {
  std::string name;
  py::object (*give)(const void* message);
  void (*set_defaults)(py::handle instance);
};
using Conversions = std::map<std::type_index, Conversion>;

const Conversions& conversions() {
  static const Conversions all = [] {
    Conversions found;
    forEachStruct([&]<class D, class W>() {
      found[typeid(D)] = {nameOfType<D>(),
                          [](const void* message) {
                            W unused{};
                            return Giver::nested(*static_cast<const D*>(message), unused);
                          },
                          [](py::handle instance) {
                            const D fresh{};
                            W unused{};
                            Giver giver(messageClass<D>(), instance);
                            wire::describe(giver, fresh, unused);
                          }};
    });
    return found;
  }();
  return all;
}

}  // namespace

py::object toPython(std::type_index type, const void* message) {
  return conversions().at(type).give(message);
}

void setDefaults(const std::string& name, py::handle instance) {
  for (const auto& [type, conversion] : conversions()) {
    if (conversion.name == name) return conversion.set_defaults(instance);
  }
}

}  // namespace perdure::python
