#include "common/types/correction_json.h"

#include <algorithm>
#include <array>
#include <string>

namespace perdure {
namespace {

using Json = nlohmann::ordered_json;

bool isGiven(const Json& request, const char* name) {
  const auto found = request.find(name);
  return found != request.end() && !found->is_null();
}

std::uint64_t idIn(const Json& request, const char* name) {
  const auto found = request.find(name);
  return found != request.end() && found->is_number_unsigned() ? found->get<std::uint64_t>() : 0;
}

std::string textIn(const Json& request, const char* name) {
  const auto found = request.find(name);
  return found != request.end() && found->is_string() ? found->get<std::string>() : std::string();
}

bool isWhole(const Correction& correction) {
  constexpr std::size_t kMostText = 256;  // bytes on the bus
  if (std::max(correction.author.size(), correction.class_name.size()) > kMostText) return false;
  if (correction.withdrawn) return correction.id != 0;
  if (correction.aboutTwo() && correction.other == 0) return false;
  if (correction.kind == CorrectionKind::kClass && correction.class_name.empty()) return false;
  return correction.object != 0;
}

}  // namespace

std::optional<Correction> correctionOf(const Json& request) {
  if (!request.is_object()) return std::nullopt;
  Correction correction;
  correction.author = textIn(request, "author");
  correction.withdrawn = isGiven(request, "withdraw");
  if (correction.withdrawn) {
    if (isGiven(request, "object") || isGiven(request, "kind")) return std::nullopt;
    correction.id = idIn(request, "withdraw");
    return isWhole(correction) ? std::optional(correction) : std::nullopt;
  }
  constexpr std::array kKinds{CorrectionKind::kNotThere, CorrectionKind::kClass,
                              CorrectionKind::kSame, CorrectionKind::kDifferent};
  const std::string name = textIn(request, "kind");
  const auto kind = std::ranges::find(kKinds, name, [](auto k) { return std::string(nameOf(k)); });
  if (kind == kKinds.end()) return std::nullopt;
  correction.kind = *kind;
  correction.object = idIn(request, "object");
  correction.other = idIn(request, "other");
  correction.class_name = textIn(request, "class");
  if (isGiven(request, "nats")) {
    const Json& nats = request.at("nats");
    correction.nats = nats.is_number() ? nats.get<double>() : -1.0;
    if (!(correction.nats > 0.0 && correction.nats <= kMostCorrectionNats)) return std::nullopt;
  }
  return isWhole(correction) ? std::optional(correction) : std::nullopt;
}

Json toJson(const Correction& correction) {
  return {{"id", correction.id},
          {"kind", nameOf(correction.kind)},
          {"object", correction.object},
          {"other", correction.other},
          {"class", correction.class_name},
          {"nats", correction.nats},
          {"author", correction.author},
          {"time_s", toSeconds(correction.time)},
          {"withdrawn", correction.withdrawn}};
}

}  // namespace perdure
