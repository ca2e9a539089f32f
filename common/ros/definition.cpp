#include "common/ros/definition.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "common/ros/autoware.h"
#include "common/ros/bytes.h"

namespace perdure::ros {
namespace {

/// The name of a struct, and the text of its fields: type and name on each line.
struct Definition {
  std::string type, message;
};

template <class X>
constexpr const char* nameOfPlain() {
  if constexpr (std::same_as<X, bool>) return "bool";
  if constexpr (std::same_as<X, std::byte>) return "byte";
  if constexpr (std::same_as<X, float>) return "float32";
  if constexpr (std::same_as<X, double>) return "float64";
  if constexpr (std::same_as<X, std::uint8_t>) return "uint8";
  if constexpr (std::same_as<X, std::uint32_t>) return "uint32";
  if constexpr (std::same_as<X, std::int32_t>) return "int32";
}

/// Visits a struct and its fields. `all` receives every struct once, contained ones first.
class Walk {
 public:
  explicit Walk(std::vector<Definition>& all) : all_(all) {}

  template <Struct M>
  void visit() {
    const auto known = [](const Definition& one) { return one.type == M::kType; };
    if (std::ranges::any_of(all_, known)) return;
    Walk inside(all_);
    const M example{};
    M::fields(example, inside);
    all_.push_back({M::kType, inside.message_});
  }

  template <Plain X>
  void operator()(const char* name, const X&) {
    add(nameOfPlain<X>(), name);
  }
  void operator()(const char* name, const std::string&) { add("string", name); }
  void operator()(const char* name, const SharedBytes&) { add("uint8[]", name); }
  template <Plain X, std::size_t N>
  void operator()(const char* name, const std::array<X, N>&) {
    add(fmt::format("{}[{}]", nameOfPlain<X>(), N), name);
  }
  template <class X>
  void operator()(const char* name, const std::vector<X>&) {
    if constexpr (Plain<X>) {
      add(std::string(nameOfPlain<X>()) + "[]", name);
    } else {
      visit<X>();
      add(std::string(X::kType) + "[]", name);
    }
  }
  template <Struct M>
  void operator()(const char* name, const M&) {
    visit<M>();
    add(M::kType, name);
  }

 private:
  void add(const std::string& type, const char* name) {
    message_ += fmt::format("{} {}\n", type, name);
  }

  std::vector<Definition>& all_;
  std::string message_;
};

}  // namespace

std::string ros2Name(const std::string& type) {
  const auto slash = type.find('/');
  return type.substr(0, slash) + "/msg" + type.substr(slash);
}

std::string plainName(const std::string& name) {
  constexpr std::string_view kMiddle = "/msg/";
  const auto middle = name.find(kMiddle);
  return middle == std::string::npos
             ? name
             : name.substr(0, middle) + "/" + name.substr(middle + kMiddle.size());
}

template <class M>
std::string definitionOf() {
  std::vector<Definition> all;
  Walk(all).visit<M>();
  std::string text = all.back().message;
  all.pop_back();
  for (const Definition& part : all) {
    text += std::string(80, '=') + "\nMSG: " + part.type + "\n" + part.message;
  }
  return text;
}

template std::string definitionOf<Image>();
template std::string definitionOf<CompressedImage>();
template std::string definitionOf<CameraInfo>();
template std::string definitionOf<Imu>();
template std::string definitionOf<PointCloud2>();
template std::string definitionOf<Odometry>();
template std::string definitionOf<TFMessage>();
template std::string definitionOf<Detection2DArray>();
template std::string definitionOf<Detection3DArray>();
template std::string definitionOf<MarkerArray>();
template std::string definitionOf<DiagnosticArray>();
template std::string definitionOf<autoware::TrackedObjects>();

}  // namespace perdure::ros
