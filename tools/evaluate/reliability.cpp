#include "tools/evaluate/reliability.h"

#include <algorithm>
#include <cmath>

namespace perdure::tools {
namespace {

double square(double x) { return x * x; }

double skillOf(double brier, double reference) {
  return reference > 0.0 ? 1.0 - brier / reference : 0.0;
}

}  // namespace

std::vector<ReliabilityBin> Reliability::bins(std::size_t count) const {
  std::vector<ReliabilityBin> result(count);
  for (const Claim& claim : claims) {
    const auto at = static_cast<std::size_t>(claim.believed * static_cast<double>(count));
    ReliabilityBin& bin = result[std::min(at, count - 1)];
    ++bin.count;
    bin.believed += claim.believed;
    bin.observed += claim.so ? 1.0 : 0.0;
  }
  for (ReliabilityBin& bin : result) {
    if (bin.count == 0) continue;
    bin.believed /= static_cast<double>(bin.count);
    bin.observed /= static_cast<double>(bin.count);
  }
  return result;
}

double Reliability::calibrationError(std::size_t count) const {
  double sum = 0.0;
  for (const ReliabilityBin& bin : bins(count)) {
    sum += static_cast<double>(bin.count) * std::abs(bin.believed - bin.observed);
  }
  return claims.empty() ? 0.0 : sum / static_cast<double>(claims.size());
}

double Reliability::brier() const {
  double sum = 0.0;
  for (const Claim& claim : claims) sum += square(claim.believed - (claim.so ? 1.0 : 0.0));
  return claims.empty() ? 0.0 : sum / static_cast<double>(claims.size());
}

double Reliability::skill() const {
  double base = 0.0;
  for (const Claim& claim : claims) base += claim.so ? 1.0 : 0.0;
  if (!claims.empty()) base /= static_cast<double>(claims.size());
  return skillOf(brier(), base * (1.0 - base));
}

Reliability ClassReliability::best() const {
  Reliability result{what, {}};
  for (const ClassClaim& claim : claims) {
    const auto top = std::ranges::max_element(
        claim.believed, [](const auto& a, const auto& b) { return a.second < b.second; });
    if (top == claim.believed.end()) continue;
    result.claims.push_back({top->second, top->first == claim.is});
  }
  return result;
}

double ClassReliability::brier() const {
  double sum = 0.0;
  for (const ClassClaim& claim : claims) {
    double hit = 0.0;
    for (const auto& [name, believed] : claim.believed) {
      if (name == claim.is)
        hit = believed;
      else
        sum += square(believed);
    }
    sum += square(1.0 - hit);
  }
  return claims.empty() ? 0.0 : sum / static_cast<double>(claims.size());
}

double ClassReliability::skill() const {
  std::map<std::string, double> share;
  for (const ClassClaim& claim : claims) share[claim.is] += 1.0 / double(claims.size());
  double reference = 1.0;
  for (const auto& [name, value] : share) reference -= square(value);
  return skillOf(brier(), claims.empty() ? 0.0 : reference);
}

}  // namespace perdure::tools
