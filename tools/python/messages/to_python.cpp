#include "tools/python/messages/to_python.h"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <map>

#include "common/wire/topics.h"
#include "tools/python/messages/choices.h"
#include "tools/python/messages/message_class.h"

namespace perdure::python {
namespace {

namespace py = pybind11;

template <class M>
py::object arrayOf(const M& m) {
  constexpr int kRows = M::RowsAtCompileTime, kCols = M::ColsAtCompileTime;
  using RowMajor =
      Eigen::Matrix<double, kRows, kCols, kCols == 1 ? int{Eigen::ColMajor} : int{Eigen::RowMajor}>;
  py::array_t<double> array =
      kCols == 1 ? py::array_t<double>(kRows) : py::array_t<double>({kRows, kCols});
  Eigen::Map<RowMajor>(array.mutable_data()) = m;
  return array;
}

template <class X>
py::object arrayOf(const std::vector<X>& numbers) {
  return py::array_t<X>(static_cast<py::ssize_t>(numbers.size()), numbers.data());
}

/// A read-only array over the existing bytes, which live as long as the array.
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

class Giver {
 public:
  Giver(const MessageClass& type, py::handle self) : type_(type), self_(self) {}

  template <class X, class W>
  void value(const char*, const X& d, W&) {
    if constexpr (std::same_as<X, bool>) {
      set(py::bool_(d));
    } else {
      set(py::int_(d));
    }
  }
  template <class W>
  void time(const char*, const TimePoint& d, W&) {
    set(py::int_(toNanoseconds(d)));
  }
  template <class W>
  void number(const char*, const double& d, W&, const wire::Limits&) {
    set(py::float_(d));
  }
  template <class W>
  void probability(const char*, const double& d, W&) {
    set(py::float_(d));
  }
  template <class E, class W>
  void choice(const char*, const E& d, W&, E) {
    const auto word = wordOf(d);
    if (word.empty()) return set(py::int_(static_cast<int>(d)));
    set(py::str(word.data(), word.size()));
  }
  template <class W>
  void text(const char*, const std::string& d, W&, std::size_t) {
    set(py::str(d));
  }
  template <class W>
  void name(const char*, const std::string& d, W&) {
    set(py::str(d));
  }
  template <class M, class W>
  void matrix(const char*, const M& d, W&, const wire::Limits&) {
    set(arrayOf(d));
  }
  template <class M, class W>
  void symmetric(const char*, const M& d, W&) {
    set(arrayOf(d));
  }
  template <class M, class W>
  void covariance(const char*, const M& d, W&) {
    set(arrayOf(d));
  }
  template <class W>
  void unit(const char*, const Eigen::Vector3d& d, W&) {
    set(arrayOf(d));
  }
  template <class W>
  void pose(const char*, const RigidTransform& d, W&) {
    static const MessageClass* const type = &messageClass("Pose");
    py::object pose = type->make();
    Giver giver(*type, pose);
    giver.set(arrayOf(Eigen::Vector4d(d.q.coeffs())));
    giver.set(arrayOf(d.p));
    set(std::move(pose));
  }
  template <class D, class W>
  void object(const char*, const D& d, W& w) {
    set(nested(d, w));
  }
  template <class D, class W>
  void optional(const char*, const std::optional<D>& d, bool, W& w) {
    set(d ? nested(*d, w) : py::object(py::none()));
  }
  template <class W>
  void optionalNumber(const char*, const std::optional<double>& d, bool, W&, const wire::Limits&) {
    set(d ? py::object(py::float_(*d)) : py::object(py::none()));
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
  template <class X, class S>
  void numbers(const char*, const std::vector<X>& d, S&, const wire::Limits&, std::size_t) {
    set(arrayOf(d));
  }
  template <class S>
  void names(const char*, const std::vector<std::string>& d, S&, std::size_t) {
    set(py::cast(d));
  }
  template <class Counts, class S>
  void counts(const char*, const Counts& d, S&, std::size_t) {
    set(py::cast(d));
  }
  template <class Bytes, class W>
  void bytes(const char*, const Bytes& d, W&) {
    set(py::array_t<std::uint8_t>(static_cast<py::ssize_t>(d.size()), d.data()));
  }
  void pixels(const char*, const Frame& d, perdure_msg_Frame&) { set(pixelsOf(d)); }
  template <class Predicate>
  void ensure(const char*, const char*, Predicate) {}
  template <class Predicate>
  void ensureWire(const char*, const char*, Predicate) {}

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

/// Conversions of a struct that a topic contains.
struct Conversion {
  std::string name;
  py::object (*give)(const void* message);
  void (*set_defaults)(py::handle instance);
};
using Conversions = std::map<std::type_index, Conversion>;

template <class D, class W>
Conversion conversionOf() {
  return {nameOfType<D>(),
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
}

/// Searches descriptions for the structs that they contain.
class Finder {
 public:
  template <class D, class W>
  void add() {
    if (!found.emplace(typeid(D), conversionOf<D, W>()).second) return;
    D d{};
    W w{};
    wire::describe(*this, d, w);
  }

  template <class D, class W>
  void object(const char*, D&, W&) {
    add<D, W>();
  }
  template <class D, class W>
  void optional(const char*, std::optional<D>&, bool, W&) {
    add<D, W>();
  }
  template <class D, class S>
  void list(const char*, std::vector<D>&, S&, std::size_t) {
    add<D, std::remove_pointer_t<decltype(S::_buffer)>>();
  }
  void value(auto&&...) {}
  void time(auto&&...) {}
  void number(auto&&...) {}
  void probability(auto&&...) {}
  void choice(auto&&...) {}
  void text(auto&&...) {}
  void name(auto&&...) {}
  void matrix(auto&&...) {}
  void symmetric(auto&&...) {}
  void covariance(auto&&...) {}
  void unit(auto&&...) {}
  void pose(auto&&...) {}
  void optionalNumber(auto&&...) {}
  void numbers(auto&&...) {}
  void names(auto&&...) {}
  void counts(auto&&...) {}
  void bytes(auto&&...) {}
  void pixels(auto&&...) {}
  void ensure(auto&&...) {}
  void ensureWire(auto&&...) {}

  Conversions found;
};

const Conversions& conversions() {
  static const Conversions all = [] {
    Finder finder;
    forEachTopic(
        [&]<class T>(const bus::Topic<T>&) { finder.add<T, typename wire::Type<T>::Wire>(); });
    return std::move(finder.found);
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
