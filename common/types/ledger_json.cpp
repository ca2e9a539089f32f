#include "common/types/ledger_json.h"

#include <fmt/format.h>

#include <string>

namespace perdure {
namespace {

using Json = nlohmann::ordered_json;

template <class Kind>
std::string nameOfKind(std::size_t i, std::size_t known) {
  return i < known ? nameOf(static_cast<Kind>(i)) : fmt::format("kind_{}", i);
}

Json natsJson(const std::vector<double>& nats) {
  Json json = Json::object();
  for (std::size_t i = 0; i < nats.size(); ++i) {
    if (nats[i] == 0.0) continue;
    json[nameOfKind<ClassEvidence>(i, kClassEvidences)] = rounded(nats[i]);
  }
  return json;
}

}  // namespace

double rounded(double value) { return std::stod(fmt::format("{:.10g}", value)); }

Json toJson(const Ledger& ledger) {
  if (ledger.empty()) return nullptr;
  Json existence = Json::object(), classes = Json::object(), ousted = Json::array();
  for (std::size_t i = 0; i < ledger.existence.size(); ++i) {
    const LedgerEntry& entry = ledger.existence[i];
    if (entry.count == 0 && entry.log_odds == 0.0) continue;
    existence[nameOfKind<ExistenceEvidence>(i, kExistenceEvidences)] = {
        {"log_odds", rounded(entry.log_odds)},
        {"count", entry.count},
        {"first_ns", toNanoseconds(entry.first)},
        {"last_ns", toNanoseconds(entry.last)}};
  }
  for (const ClassLedger& each : ledger.classes) classes[each.name] = natsJson(each.log_odds);
  for (const OustedClass& each : ledger.ousted) {
    ousted.push_back({{"class", each.name},
                      {"by", each.by},
                      {"at_ns", toNanoseconds(each.at)},
                      {"log_odds", natsJson(each.log_odds)}});
  }
  return {{"existence", existence}, {"classes", classes}, {"ousted", ousted}};
}

}  // namespace perdure
