#include "common/wire/json.h"

#include <cmath>

namespace perdure::wire {
namespace {

using Json = nlohmann::ordered_json;

/// Returns null for NaN and infinity, which JSON does not have.
Json numberJson(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json choiceJson(EventKind kind) { return nameOf(kind); }
Json choiceJson(Visibility visibility) { return nameOf(visibility); }
Json choiceJson(auto value) { return static_cast<int>(value); }

class JsonWriter {
 public:
  Json take() { return std::move(json_); }

  void value(const char* name, const auto& d, auto&) { json_[name] = d; }
  void time(const char* name, const TimePoint& d, auto&) { json_[name] = toNanoseconds(d); }
  void number(const char* name, const double& d, auto&, const Limits&) {
    json_[name] = numberJson(d);
  }
  void probability(const char* name, const double& d, auto&) { json_[name] = numberJson(d); }
  void choice(const char* name, const auto& d, auto&, auto) { json_[name] = choiceJson(d); }
  void text(const char* name, const std::string& d, auto&, std::size_t) { json_[name] = d; }
  void name(const char* field, const std::string& d, auto&) { json_[field] = d; }
  void matrix(const char* name, const auto& d, auto&, const Limits&) {
    Json rows = Json::array();
    for (Eigen::Index r = 0; r < d.rows(); ++r) {
      Json row = Json::array();
      for (Eigen::Index c = 0; c < d.cols(); ++c) row.push_back(numberJson(d(r, c)));
      rows.push_back(d.cols() == 1 ? row[0] : std::move(row));
    }
    json_[name] = std::move(rows);
  }
  void symmetric(const char* name, const auto& d, auto& w) { matrix(name, d, w, kMatrixEntry); }
  void covariance(const char* name, const auto& d, auto& w) { matrix(name, d, w, kMatrixEntry); }
  void unit(const char* name, const Eigen::Vector3d& d, auto& w) {
    matrix(name, d, w, kMatrixEntry);
  }
  void pose(const char* name, const RigidTransform& d, auto&) {
    json_[name] = {{"q_xyzw", {d.q.x(), d.q.y(), d.q.z(), d.q.w()}},
                   {"p", {d.p.x(), d.p.y(), d.p.z()}}};
  }
  void object(const char* name, const auto& d, auto& w) { json_[name] = nested(d, w); }
  void optional(const char* name, const auto& d, bool, auto& w) {
    json_[name] = d ? nested(*d, w) : Json(nullptr);
  }
  void optionalNumber(const char* name, const auto& d, bool, auto&, const Limits&) {
    json_[name] = d ? numberJson(*d) : Json(nullptr);
  }
  void list(const char* name, const auto& d, auto& w, std::size_t) {
    Json items = Json::array();
    std::remove_pointer_t<decltype(w._buffer)> unused{};
    for (const auto& item : d) items.push_back(nested(item, unused));
    json_[name] = std::move(items);
  }
  void numbers(const char* name, const auto& d, auto&, const Limits&, std::size_t) {
    json_[name] = d;
  }
  void names(const char* field, const auto& d, auto&, std::size_t) { json_[field] = d; }
  void counts(const char* field, const auto& d, auto&, std::size_t) { json_[field] = d; }
  void bytes(const char* name, const auto& d, auto&) {
    std::string hex;
    for (const std::uint8_t b : d) hex += {"0123456789abcdef"[b >> 4], "0123456789abcdef"[b & 15]};
    json_[name] = hex;
  }
  void pixels(const char*, const Frame& d, auto&) { json_["bytes"] = d.data ? d.data->size() : 0; }
  void ensure(const char*, const char*, auto) {}
  void ensureWire(const char*, const char*, auto) {}

 private:
  static Json nested(const auto& d, auto& w) {
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
