#include <pybind11/numpy.h>

#include <limits>
#include <map>

#include "tools/python/messages/choices.h"
#include "tools/python/messages/convert.h"
#include "tools/python/messages/fields.h"
#include "tools/python/messages/message_class.h"
#include "tools/python/messages/raise.h"

namespace perdure::python {
namespace {

namespace py = pybind11;

std::string kindOf(py::handle object) { return Py_TYPE(object.ptr())->tp_name; }

std::string shapeText(const py::array& array) {
  return py::str(array.attr("shape")).cast<std::string>();
}

/// Keeps an array alive for readers; the last reader may end in any thread.
std::shared_ptr<const void> keeperOf(py::array array) {
  PyObject* const kept = array.release().ptr();
  return {kept, [](const void* object) {
            const py::gil_scoped_acquire gil;
            Py_DECREF(static_cast<PyObject*>(const_cast<void*>(object)));
          }};
}

class Taker : public EachField<Taker> {
 public:
  Taker(py::handle from, std::string path) : from_(from), path_(std::move(path)) {}

  template <class D, class W>
  static void take(py::handle from, const std::string& path, D& d, W& w) {
    if (!messageClass<D>().isOne(from)) {
      const std::string what = path.empty() ? "the message" : path.substr(0, path.size() - 1);
      raise("Refused", what + " must be a perdure." + nameOfType<D>() + ", not " + kindOf(from));
    }
    Taker taker(from, path);
    wire::describe(taker, d, w);
  }

  void field(const char* name, auto& d, const auto&) { set(name, get(name), d); }
  template <class E, class W>
  void choice(const char* name, E& d, W&, E last) {
    const py::object object = get(name);
    std::string words;
    for (std::size_t i = 0; i <= static_cast<std::size_t>(last); ++i) {
      const std::string word(wordOf(static_cast<E>(i)));
      if (word.empty()) {
        d = static_cast<E>(whole<std::uint8_t>(name, object));
        return;
      }
      if (py::isinstance<py::str>(object) && object.cast<std::string>() == word) {
        d = static_cast<E>(i);
        return;
      }
      words += (words.empty() ? "" : ", ") + word;
    }
    refuse(name, "must be one of " + words);
  }
  template <class D, class W>
  void object(const char* name, D& d, W& w) {
    take(get(name), path_ + name + ".", d, w);
  }
  template <class D, class W>
  void optional(const char* name, std::optional<D>& d, bool, W& w) {
    const py::object object = get(name);
    if (!object.is_none()) take(object, path_ + name + ".", d.emplace(), w);
  }
  template <class D, class S>
  void list(const char* name, std::vector<D>& d, S&, std::size_t) {
    const py::object items = get(name);
    if (!PySequence_Check(items.ptr()))
      refuse(name, "must be a list of perdure." + nameOfType<D>());
    std::remove_pointer_t<decltype(S::_buffer)> unused{};
    d.resize(py::len(items));
    for (std::size_t i = 0; i < d.size(); ++i) {
      const py::object item = items[py::int_(i)];
      take(item, path_ + name + "[" + std::to_string(i) + "].", d[i], unused);
    }
  }
  void pixels(const char* name, Frame& d, perdure_msg_Frame&) {
    const auto array = arrayAs<std::uint8_t>(name, get(name));
    const auto channels = channelsOf(d.encoding);
    const bool fits = array.ndim() == (channels > 1 ? 3 : 2) && array.shape(0) == d.height &&
                      array.shape(1) == d.width && (channels == 1 || array.shape(2) == channels);
    if (!isCompressed(d.encoding) && !fits) {
      refuse(name, "must have shape (" + std::to_string(d.height) + ", " + std::to_string(d.width) +
                       (channels > 1 ? ", " + std::to_string(channels) : "") + "), (height, width" +
                       (channels > 1 ? ", 3" : "") + "), not " + shapeText(array));
    }
    const std::span<const std::uint8_t> bytes(array.data(), static_cast<std::size_t>(array.size()));
    d.data = {keeperOf(array), bytes};
  }

 private:
  [[noreturn]] void refuse(const char* name, const std::string& what) const {
    raise("Refused", path_ + name + " " + what);
  }
  py::object get(const char* name) const { return from_.attr(name); }

  template <class X>
  X whole(const char* name, py::handle object) const {
    const auto index = py::reinterpret_steal<py::object>(PyNumber_Index(object.ptr()));
    const std::string range = " from " + std::to_string(std::numeric_limits<X>::min()) + " to " +
                              std::to_string(std::numeric_limits<X>::max());
    if (!index) {
      PyErr_Clear();
      refuse(name, "must be an int" + range + ", not " + kindOf(object));
    }
    try {
      return index.template cast<X>();
    } catch (const py::cast_error&) {
      refuse(name, "must be" + range + ", not " + py::str(object).cast<std::string>());
    }
  }
  double real(const char* name, py::handle object) const {
    const double number = PyFloat_AsDouble(object.ptr());
    if (number == -1.0 && PyErr_Occurred() != nullptr) {
      PyErr_Clear();
      refuse(name, "must be a number, not " + kindOf(object));
    }
    return number;
  }
  std::string word(const char* name, py::handle object) const {
    if (!py::isinstance<py::str>(object)) refuse(name, "must be a str, not " + kindOf(object));
    return object.cast<std::string>();
  }
  template <class X>
  py::array_t<X, py::array::c_style | py::array::forcecast> arrayAs(const char* name,
                                                                    py::handle object) const {
    using Array = py::array_t<X, py::array::c_style | py::array::forcecast>;
    auto array = object.is_none() ? Array() : Array::ensure(object);
    if (object.is_none() || !array) {
      PyErr_Clear();
      refuse(name, "must be an array of numbers, not " + kindOf(object));
    }
    return array;
  }
  template <std::integral X>
  void set(const char* name, py::handle object, X& d) const {
    d = whole<X>(name, object);
  }
  void set(const char*, py::handle object, bool& d) const {
    const int is = PyObject_IsTrue(object.ptr());
    if (is < 0) throw py::error_already_set();
    d = is != 0;
  }
  void set(const char* name, py::handle object, TimePoint& d) const {
    d = fromNanoseconds(whole<std::int64_t>(name, object));
  }
  void set(const char* name, py::handle object, double& d) const { d = real(name, object); }
  void set(const char* name, py::handle object, std::optional<double>& d) const {
    if (!object.is_none()) d = real(name, object);
  }
  void set(const char* name, py::handle object, std::string& d) const { d = word(name, object); }
  void set(const char* name, py::handle pose, RigidTransform& d) const {
    if (!messageClass("Pose").isOne(pose)) refuse(name, "must be a perdure.Pose");
    const Taker inner(pose, path_ + name + ".");
    Eigen::Vector4d q;
    inner.set("q_xyzw", inner.get("q_xyzw"), q);
    inner.set("p", inner.get("p"), d.p);
    d.q.coeffs() = q;
  }
  template <std::floating_point X>
  void set(const char* name, py::handle object, std::vector<X>& d) const {
    const auto array = arrayAs<X>(name, object);
    if (array.ndim() != 1) refuse(name, "must have shape (n,), not " + shapeText(array));
    d.assign(array.data(), array.data() + array.size());
  }
  void set(const char* name, py::handle items, std::vector<std::string>& d) const {
    if (!PySequence_Check(items.ptr()) || py::isinstance<py::str>(items)) {
      refuse(name, "must be a list of str");
    }
    for (const auto& item : items) d.push_back(word(name, item));
  }
  void set(const char* name, py::handle items, std::map<std::string, std::uint64_t>& d) const {
    if (!py::isinstance<py::dict>(items)) refuse(name, "must be a dict of str to int");
    for (const auto& [key, n] : py::reinterpret_borrow<py::dict>(items)) {
      d[word(name, key)] = whole<std::uint64_t>(name, n);
    }
  }
  template <std::size_t N>
  void set(const char* name, py::handle object, std::array<std::uint8_t, N>& d) const {
    const auto array = arrayAs<std::uint8_t>(name, object);
    if (array.size() != static_cast<py::ssize_t>(N)) {
      refuse(name, "must have shape (" + std::to_string(N) + ",), not " + shapeText(array));
    }
    std::copy(array.data(), array.data() + N, d.begin());
  }
  template <class M>
  void set(const char* name, py::handle object, Eigen::MatrixBase<M>& d) const {
    constexpr int kRows = M::RowsAtCompileTime, kCols = M::ColsAtCompileTime;
    const auto array = arrayAs<double>(name, object);
    const bool fits = kCols == 1
                          ? array.ndim() == 1 && array.shape(0) == kRows
                          : array.ndim() == 2 && array.shape(0) == kRows && array.shape(1) == kCols;
    if (!fits) {
      refuse(name, "must have shape (" + std::to_string(kRows) +
                       (kCols == 1 ? "," : ", " + std::to_string(kCols)) + "), not " +
                       shapeText(array));
    }
    for (int r = 0; r < kRows; ++r) {
      for (int c = 0; c < kCols; ++c)
        d(r, c) = static_cast<typename M::Scalar>(array.data()[r * kCols + c]);
    }
  }

  py::handle from_;
  std::string path_;
};

using Take = void (*)(py::handle from, void* message);

const std::map<std::type_index, Take>& takes() {
  static const auto all = [] {
    std::map<std::type_index, Take> found;
    wire::forEachTopic([&]<class Row>(const Row&) {
      using Message = typename Row::Message;
      found[typeid(Message)] = [](py::handle from, void* message) {
        typename Row::Wire unused{};
        Taker::take(from, "", *static_cast<Message*>(message), unused);
      };
    });
    return found;
  }();
  return all;
}

}  // namespace

void fromPython(std::type_index type, py::handle from, void* message) {
  takes().at(type)(from, message);
}

}  // namespace perdure::python
