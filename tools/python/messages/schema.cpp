#include "tools/python/messages/schema.h"

#include <pybind11/stl.h>

#include "common/wire/topics.h"
#include "tools/python/messages/choices.h"
#include "tools/python/messages/message_class.h"

namespace perdure::python {
namespace {

namespace py = pybind11;

/// Compares the address of the limits, because limits with equal numbers may have different units.
const char* unitOf(const wire::Limits& limits) {
  using namespace wire;
  struct Unit {
    const Limits* limits;
    const char* text;
  };
  static constexpr std::array kUnits{
      Unit{&kProbability, "0 to 1"}, Unit{&kCoordinate, "m"},      Unit{&kPixel, "px"},
      Unit{&kAngle, "rad"},          Unit{&kAngularRate, "rad/s"}, Unit{&kAcceleration, "m/s²"},
      Unit{&kSpeed, "m/s"},          Unit{&kNats, "nats"},         Unit{&kLatitudeDeg, "°"},
      Unit{&kLongitudeDeg, "°"},     Unit{&kOffset, "s"},          Unit{&kLogit, "nats"}};
  for (const Unit& unit : kUnits) {
    if (unit.limits == &limits) return unit.text;
  }
  return "";
}

class Schema {
 public:
  template <class D, class W>
  void add() {
    const std::string& name = nameOfType<D>();
    if (structs_.contains(name)) return;
    const py::list outer = std::exchange(fields_, py::list());
    D d{};
    W w{};
    wire::describe(*this, d, w);
    structs_[name.c_str()] = std::exchange(fields_, outer);
  }
  py::dict take() { return std::move(structs_); }

  template <class X, class W>
  void value(const char* name, X&, W&) {
    field(name, std::same_as<X, bool> ? "bool" : std::is_integral_v<X> ? "int" : "float");
  }
  template <class W>
  void time(const char* name, TimePoint&, W&) {
    field(name, "int", py::none(), "ns, sensor clock");
  }
  template <class W>
  void number(const char* name, double&, W&, const wire::Limits& limits) {
    field(name, "float", py::none(), unitOf(limits));
  }
  template <class W>
  void probability(const char* name, double&, W&) {
    field(name, "float", py::none(), unitOf(wire::kProbability));
  }
  template <class E, class W>
  void choice(const char* name, E&, W&, E last) {
    py::list words;
    for (std::size_t i = 0; i <= static_cast<std::size_t>(last); ++i) {
      const auto word = wordOf(static_cast<E>(i));
      if (!word.empty()) words.append(py::str(word.data(), word.size()));
    }
    field(name, words.empty() ? "int" : "choice", py::none(), "", words);
  }
  template <class W>
  void text(const char* name, std::string&, W&, std::size_t) {
    field(name, "str");
  }
  template <class W>
  void name(const char* name, std::string&, W&) {
    field(name, "str", py::none(), "not empty");
  }
  template <class M, class W>
  void matrix(const char* name, M& m, W&, const wire::Limits& limits) {
    array(name, m, unitOf(limits));
  }
  template <class M, class W>
  void symmetric(const char* name, M& m, W&) {
    array(name, m, "symmetric");
  }
  template <class M, class W>
  void covariance(const char* name, M& m, W&) {
    array(name, m, "symmetric, positive definite");
  }
  template <class W>
  void unit(const char* name, Eigen::Vector3d& m, W&) {
    array(name, m, "of length 1");
  }
  template <class W>
  void pose(const char* name, RigidTransform&, W&) {
    field(name, "pose");
  }
  template <class D, class W>
  void object(const char* name, D&, W&) {
    add<D, W>();
    field(name, "message", py::none(), "", py::str(nameOfType<D>()));
  }
  template <class D, class W>
  void optional(const char* name, std::optional<D>&, bool, W&) {
    add<D, W>();
    field(name, "optional_message", py::none(), "", py::str(nameOfType<D>()));
  }
  template <class W>
  void optionalNumber(const char* name, std::optional<double>&, bool, W&,
                      const wire::Limits& limits) {
    field(name, "optional_float", py::none(), unitOf(limits));
  }
  template <class D, class S>
  void list(const char* name, std::vector<D>&, S&, std::size_t) {
    add<D, std::remove_pointer_t<decltype(S::_buffer)>>();
    field(name, "list", py::none(), "", py::str(nameOfType<D>()));
  }
  template <class X, class S>
  void numbers(const char* name, std::vector<X>&, S&, const wire::Limits& limits, std::size_t) {
    field(name, "array", py::make_tuple(py::none()), unitOf(limits),
          py::str(std::same_as<X, float> ? "float32" : "float64"));
  }
  template <class S>
  void names(const char* name, std::vector<std::string>&, S&, std::size_t) {
    field(name, "names");
  }
  template <class Counts, class S>
  void counts(const char* name, Counts&, S&, std::size_t) {
    field(name, "counts");
  }
  template <class Bytes, class W>
  void bytes(const char* name, Bytes& bytes, W&) {
    field(name, "bytes", py::make_tuple(bytes.size()), "", py::str("uint8"));
  }
  void pixels(const char* name, Frame&, perdure_msg_Frame&) { field(name, "pixels"); }
  template <class Predicate>
  void ensure(const char*, const char*, Predicate) {}
  template <class Predicate>
  void ensureWire(const char*, const char*, Predicate) {}

 private:
  template <class M>
  void array(const char* name, const M& m, const char* unit) {
    const py::tuple shape =
        m.cols() == 1 ? py::make_tuple(m.rows()) : py::make_tuple(m.rows(), m.cols());
    field(name, "array", shape, unit, py::str("float64"));
  }
  void field(const char* name, const char* kind, py::object shape = py::none(),
             const char* unit = "", py::object item = py::none()) {
    fields_.append(py::make_tuple(name, kind, shape, unit, item));
  }

  py::dict structs_;
  py::list fields_;
};

}  // namespace

py::dict schema() {
  Schema found;
  forEachTopic(
      [&]<class T>(const bus::Topic<T>&) { found.add<T, typename wire::Type<T>::Wire>(); });
  return found.take();
}

py::dict topicTypes() {
  py::dict types;
  for (const bus::TopicInfo& info : bus::topicTable()) {
    const std::string name(info.name);
    bus::withTopic(name.ends_with('/') ? name + "cam0" : name,
                   [&]<class T>(const bus::Topic<T>&) { types[name.c_str()] = nameOfType<T>(); });
  }
  return types;
}

}  // namespace perdure::python
