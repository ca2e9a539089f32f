#include "common/ros/definition.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "common/ros/bytes.h"

namespace perdure::ros {
namespace {

/// A struct's fields: type and name of each, and what it is made of, before it.
struct Definition {
  std::string type, message, idl;
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

/// IDL's name for what `.msg` calls so.
std::string idlName(const std::string& type) {
  const std::pair<const char*, const char*> kNames[] = {
      {"bool", "boolean"},   {"byte", "octet"},           {"uint8", "octet"}, {"float32", "float"},
      {"float64", "double"}, {"uint32", "unsigned long"}, {"int32", "long"},  {"string", "string"}};
  for (const auto& [name, idl] : kNames) {
    if (type == name) return idl;
  }
  const auto slash = type.find('/');
  return type.substr(0, slash) + "::msg::dds_::" + type.substr(slash + 1) + "_";
}

/// Goes through a struct and writes its fields down; `all` gets every struct once, parts first.
class Walk {
 public:
  explicit Walk(std::vector<Definition>& all) : all_(all) {}

  template <Struct M>
  void visit() {
    const auto known = [](const Definition& one) { return one.type == M::kType; };
    if (std::any_of(all_.begin(), all_.end(), known)) return;
    Walk inside(all_);
    const M example{};
    M::fields(example, inside);
    all_.push_back({M::kType, inside.message_, inside.idl_});
  }

  template <Plain X>
  void operator()(const char* name, const X&) {
    add(nameOfPlain<X>(), name, "", "");
  }
  void operator()(const char* name, const std::string&) { add("string", name, "", ""); }
  void operator()(const char* name, const SharedBytes&) { addSequence("uint8", name); }
  template <Plain X, std::size_t N>
  void operator()(const char* name, const std::array<X, N>&) {
    const std::string size = fmt::format("[{}]", N);
    add(nameOfPlain<X>(), name, size, size);
  }
  template <class X>
  void operator()(const char* name, const std::vector<X>&) {
    if constexpr (Plain<X>) {
      addSequence(nameOfPlain<X>(), name);
    } else {
      visit<X>();
      addSequence(X::kType, name);
    }
  }
  template <Struct M>
  void operator()(const char* name, const M&) {
    visit<M>();
    add(M::kType, name, "", "");
  }

 private:
  void add(const std::string& type, const char* name, const std::string& size,
           const std::string& idl_size) {
    message_ += fmt::format("{}{} {}\n", type, size, name);
    idl_ += fmt::format("        {} {}_{};\n", idlName(type), name, idl_size);
  }
  void addSequence(const std::string& type, const char* name) {
    message_ += fmt::format("{}[] {}\n", type, name);
    idl_ += fmt::format("        sequence<{}> {}_;\n", idlName(type), name);
  }

  std::vector<Definition>& all_;
  std::string message_, idl_;
};

template <class M>
std::vector<Definition> definitionsIn() {
  std::vector<Definition> all;
  Walk(all).visit<M>();
  return all;
}

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
  auto all = definitionsIn<M>();
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

std::string idlText() {
  std::vector<Definition> all;
  Walk walk(all);
  walk.visit<Image>(), walk.visit<CompressedImage>(), walk.visit<CameraInfo>();
  walk.visit<Imu>(), walk.visit<PointCloud2>(), walk.visit<Odometry>();
  walk.visit<TFMessage>(), walk.visit<Detection2DArray>(), walk.visit<Detection3DArray>();
  walk.visit<MarkerArray>(), walk.visit<DiagnosticArray>();
  std::string text;
  for (const Definition& part : all) {
    const auto slash = part.type.find('/');
    text += fmt::format(
        "module {} {{ module msg {{ module dds_ {{\n    @final\n    struct {}_ {{\n{}    }};\n"
        "}}; }}; }};\n",
        part.type.substr(0, slash), part.type.substr(slash + 1), part.idl);
  }
  return text;
}

}  // namespace perdure::ros
