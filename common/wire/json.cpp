#include "common/wire/json.h"

#include <cmath>

namespace perdure::wire {
namespace {

using Json = nlohmann::ordered_json;

/// JSON has neither NaN nor infinity; null replaces them.
Json numberJson(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json choiceJson(EventKind kind) { return nameOf(kind); }
Json choiceJson(Visibility visibility) { return nameOf(visibility); }
template <class E>
Json choiceJson(E value) {
  return static_cast<int>(value);
}

class JsonWriter {
 public:
  Json take() { return std::move(json_); }

  template <class X, class W>
  void value(const char* name, const X& d, W&) {
    json_[name] = d;
  }
  template <class W>
  void time(const char* name, const TimePoint& d, W&) {
    json_[name] = toNanoseconds(d);
  }
  template <class W>
  void number(const char* name, const double& d, W&, const Limits&) {
    json_[name] = numberJson(d);
  }
  template <class W>
  void probability(const char* name, const double& d, W&) {
    json_[name] = numberJson(d);
  }
  template <class E, class W>
  void choice(const char* name, const E& d, W&, E) {
    json_[name] = choiceJson(d);
  }
  template <class W>
  void text(const char* name, const std::string& d, W&, std::size_t) {
    json_[name] = d;
  }
  template <class W>
  void name(const char* field, const std::string& d, W&) {
    json_[field] = d;
  }
  template <class M, class W>
  void matrix(const char* name, const M& d, W&, const Limits&) {
    Json rows = Json::array();
    for (Eigen::Index r = 0; r < d.rows(); ++r) {
      Json row = Json::array();
      for (Eigen::Index c = 0; c < d.cols(); ++c) row.push_back(numberJson(d(r, c)));
      rows.push_back(d.cols() == 1 ? row[0] : std::move(row));
    }
    json_[name] = std::move(rows);
  }
  template <class M, class W>
  void symmetric(const char* name, const M& d, W& w) {
    matrix(name, d, w, kMatrixEntry);
  }
  template <class M, class W>
  void covariance(const char* name, const M& d, W& w) {
    matrix(name, d, w, kMatrixEntry);
  }
  template <class W>
  void unit(const char* name, const Eigen::Vector3d& d, W& w) {
    matrix(name, d, w, kMatrixEntry);
  }
  template <class W>
  void pose(const char* name, const RigidTransform& d, W&) {
    json_[name] = {{"q_xyzw", {d.q.x(), d.q.y(), d.q.z(), d.q.w()}},
                   {"p", {d.p.x(), d.p.y(), d.p.z()}}};
  }
  template <class D, class W>
  void object(const char* name, const D& d, W& w) {
    json_[name] = nested(d, w);
  }
  template <class D, class W>
  void optional(const char* name, const std::optional<D>& d, bool, W& w) {
    json_[name] = d ? nested(*d, w) : Json(nullptr);
  }
  template <class W>
  void optionalNumber(const char* name, const std::optional<double>& d, bool, W&, const Limits&) {
    json_[name] = d ? numberJson(*d) : Json(nullptr);
  }
  template <class D, class S>
  void list(const char* name, const std::vector<D>& d, S&, std::size_t) {
    Json items = Json::array();
    std::remove_pointer_t<decltype(S::_buffer)> unused{};
    for (const D& item : d) items.push_back(nested(item, unused));
    json_[name] = std::move(items);
  }
  template <class X, class S>
  void numbers(const char* name, const std::vector<X>& d, S&, const Limits&, std::size_t) {
    json_[name] = d;
  }
  template <class S>
  void names(const char* field, const std::vector<std::string>& d, S&, std::size_t) {
    json_[field] = d;
  }
  template <class Counts, class S>
  void counts(const char* field, const Counts& d, S&, std::size_t) {
    json_[field] = d;
  }
  template <class Bytes, class W>
  void bytes(const char* name, const Bytes& d, W&) {
    std::string hex;
    for (const std::uint8_t b : d) hex += {"0123456789abcdef"[b >> 4], "0123456789abcdef"[b & 15]};
    json_[name] = hex;
  }
  template <class W>
  void pixels(const char*, const Frame& d, W&) {
    json_["bytes"] = d.data ? d.data->size() : 0;
  }
  template <class Predicate>
  void ensure(const char*, const char*, Predicate) {}
  template <class Predicate>
  void ensureWire(const char*, const char*, Predicate) {}

 private:
  template <class D, class W>
  static Json nested(const D& d, W& w) {
    JsonWriter writer;
    describe(writer, d, w);
    return writer.take();
  }

  Json json_ = Json::object();
};

}  // namespace

template <class T>
Json toJson(const T& value) {
  JsonWriter writer;
  typename Type<T>::Wire unused{};
  describe(writer, value, unused);
  return writer.take();
}

template <class Rows>
struct JsonInstances;
template <class... Rows>
struct JsonInstances<std::tuple<Rows...>> {
  static constexpr std::tuple kToJson{&toJson<typename Rows::Message>...};
};
template struct JsonInstances<Topics>;

}  // namespace perdure::wire
