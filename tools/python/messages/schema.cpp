#include <pybind11/stl.h>

#include "tools/python/messages/choices.h"
#include "tools/python/messages/convert.h"
#include "tools/python/messages/fields.h"
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

const char* unitOf(const char* text) { return text; }

struct Kind {
  const char* name;
  py::object shape = py::none(), item = py::none();
};

template <std::integral X>
Kind kindOf(X) {
  return {std::same_as<X, bool> ? "bool" : "int"};
}
Kind kindOf(TimePoint) { return {"int"}; }
Kind kindOf(double) { return {"float"}; }
Kind kindOf(const std::string&) { return {"str"}; }
Kind kindOf(const RigidTransform&) { return {"pose"}; }
Kind kindOf(const std::optional<double>&) { return {"optional_float"}; }
Kind kindOf(const std::vector<std::string>&) { return {"names"}; }
Kind kindOf(const std::map<std::string, std::uint64_t>&) { return {"counts"}; }
template <class M>
Kind kindOf(const Eigen::MatrixBase<M>& m) {
  return {"array", m.cols() == 1 ? py::make_tuple(m.rows()) : py::make_tuple(m.rows(), m.cols()),
          py::str("float64")};
}
template <std::floating_point X>
Kind kindOf(const std::vector<X>&) {
  return {"array", py::make_tuple(py::none()),
          py::str(std::same_as<X, float> ? "float32" : "float64")};
}
template <std::size_t N>
Kind kindOf(const std::array<std::uint8_t, N>&) {
  return {"bytes", py::make_tuple(N), py::str("uint8")};
}

class Fields : public EachField<Fields> {
 public:
  void field(const char* name, const auto& d, const auto& unit) {
    add(name, kindOf(d), unitOf(unit));
  }
  template <class E, class W>
  void choice(const char* name, E&, W&, E last) {
    py::list words;
    for (std::size_t i = 0; i <= static_cast<std::size_t>(last); ++i) {
      const auto word = wordOf(static_cast<E>(i));
      if (!word.empty()) words.append(py::str(word.data(), word.size()));
    }
    add(name, {words.empty() ? "int" : "choice", py::none(), words});
  }
  template <class D, class W>
  void object(const char* name, D&, W&) {
    add(name, {"message", py::none(), py::str(nameOfType<D>())});
  }
  template <class D, class W>
  void optional(const char* name, std::optional<D>&, bool, W&) {
    add(name, {"optional_message", py::none(), py::str(nameOfType<D>())});
  }
  template <class D, class S>
  void list(const char* name, std::vector<D>&, S&, std::size_t) {
    add(name, {"list", py::none(), py::str(nameOfType<D>())});
  }
  void pixels(const char* name, Frame&, perdure_msg_Frame&) { add(name, {"pixels"}); }

  py::list all;

 private:
  void add(const char* name, const Kind& kind, const char* unit = "") {
    all.append(py::make_tuple(name, kind.name, kind.shape, unit, kind.item));
  }
};

}  // namespace

py::dict schema() {
  py::dict structs;
  forEachStruct([&]<class D, class W>() {
    Fields fields;
    D d{};
    W w{};
    wire::describe(fields, d, w);
    structs[nameOfType<D>().c_str()] = fields.all;
  });
  return structs;
}

py::dict topicTypes() {
  py::dict types;
  wire::forEachTopic([&]<class Row>(const Row& row) {
    types[py::str(row.name.data(), row.name.size())] = nameOfType<typename Row::Message>();
  });
  return types;
}

}  // namespace perdure::python
