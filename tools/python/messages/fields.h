// Visits the message descriptions in common/types, for the conversions and for the schema.
#pragma once

#include <set>
#include <typeindex>
#include <utility>

#include "common/wire/topics.h"

namespace perdure::python {

/// Calls Self::field(name, value, unit) for fields whose kind follows from their type. For other
/// fields, Self has object, optional, list, choice and pixels.
template <class Self>
class EachField {
 public:
  void value(const char* name, auto& d, auto&) { pass(name, d); }
  void time(const char* name, auto& d, auto&) { pass(name, d, "ns, sensor clock"); }
  void number(const char* name, auto& d, auto&, const wire::Limits& limits) {
    pass(name, d, limits);
  }
  void probability(const char* name, auto& d, auto&) { pass(name, d, wire::kProbability); }
  void text(const char* name, auto& d, auto&, std::size_t) { pass(name, d); }
  void name(const char* name, auto& d, auto&) { pass(name, d, "not empty"); }
  void matrix(const char* name, auto& d, auto&, const wire::Limits& limits) {
    pass(name, d, limits);
  }
  void symmetric(const char* name, auto& d, auto&) { pass(name, d, "symmetric"); }
  void covariance(const char* name, auto& d, auto&) {
    pass(name, d, "symmetric, positive definite");
  }
  void unit(const char* name, auto& d, auto&) { pass(name, d, "of length 1"); }
  void pose(const char* name, auto& d, auto&) { pass(name, d); }
  void optionalNumber(const char* name, auto& d, bool, auto&, const wire::Limits& limits) {
    pass(name, d, limits);
  }
  void numbers(const char* name, auto& d, auto&, const wire::Limits& limits, std::size_t) {
    pass(name, d, limits);
  }
  void names(const char* name, auto& d, auto&, std::size_t) { pass(name, d); }
  void counts(const char* name, auto& d, auto&, std::size_t) { pass(name, d); }
  void bytes(const char* name, auto& d, auto&) { pass(name, d); }
  void ensure(auto&&...) {}
  void ensureWire(auto&&...) {}

 private:
  void pass(const char* name, auto& d, const auto& unit) {
    static_cast<Self&>(*this).field(name, d, unit);
  }
  void pass(const char* name, auto& d) { pass(name, d, ""); }
};

/// Calls visit.operator()<D, W>() for each message struct, after the structs that it contains.
template <class Visit>
class EachStruct : public EachField<EachStruct<Visit>> {
 public:
  explicit EachStruct(Visit visit) : visit_(std::move(visit)) {}

  template <class D, class W>
  void add() {
    if (!seen_.insert(typeid(D)).second) return;
    D d{};
    W w{};
    wire::describe(*this, d, w);
    visit_.template operator()<D, W>();
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
  void choice(auto&&...) {}
  void pixels(auto&&...) {}
  void field(auto&&...) {}

 private:
  Visit visit_;
  std::set<std::type_index> seen_;
};

/// Calls visit for the structs of all topics.
template <class Visit>
void forEachStruct(Visit visit) {
  EachStruct<Visit> structs(std::move(visit));
  wire::forEachTopic([&]<class Row>(const Row&) {
    structs.template add<typename Row::Message, typename Row::Wire>();
  });
}

}  // namespace perdure::python
