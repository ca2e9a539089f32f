#include "tests/scenario/verdict.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/base/check.h"

namespace perdure::test {
namespace {

const KnownFailure* rowOf(const std::vector<KnownFailure>& known, const std::string& bar) {
  const auto row =
      std::find_if(known.begin(), known.end(), [&](const auto& one) { return one.bar == bar; });
  return row == known.end() ? nullptr : &*row;
}

double combined(const Bar& bar, const std::vector<double>& by_seed) {
  const auto isNan = [](double value) { return std::isnan(value); };
  if (std::any_of(by_seed.begin(), by_seed.end(), isNan)) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  if (bar.of == Of::kMean) {
    return std::accumulate(by_seed.begin(), by_seed.end(), 0.0) /
           static_cast<double>(by_seed.size());
  }
  const auto [least, most] = std::minmax_element(by_seed.begin(), by_seed.end());
  return bar.sense == Sense::kAtLeast ? *least : *most;
}

/// Returns the complaint about a verdict, or "".
std::string complaint(const Verdict& v, const KnownFailure* row) {
  const std::string said = fmt::format("{} is {:.3g}", v.bar.what, v.bar.measured);
  if (row == nullptr) {
    return v.meets() ? "" : said + fmt::format(" and must be {:.3g}", v.bar.limit);
  }
  if (Verdict{{"", row->tolerated, v.bar.sense, v.bar.limit}, {}}.meets()) {
    return fmt::format("{}: its row tolerates {:.3g}, which the bar does not forbid", v.bar.what,
                       row->tolerated);
  }
  if (v.meets()) return said + " and passes now: take its row out of known_failures.csv";
  if (v.meets(row->tolerated)) return "";
  return said + fmt::format(", worse than the {:.3g} that known_failures.csv tolerates ({})",
                            row->tolerated, row->why);
}

std::string standing(const Verdict& v, const KnownFailure* row) {
  if (v.meets()) return "passes";
  if (row == nullptr) return "FAILS";
  return fmt::format("{} {:.3g}: {}", v.meets(row->tolerated) ? "tolerated to" : "WORSE than",
                     row->tolerated, row->why);
}

}  // namespace

Bars operator+(Bars bars, const Bars& more) {
  bars.insert(bars.end(), more.begin(), more.end());
  return bars;
}

bool Verdict::meets(double limit) const {
  return bar.sense == Sense::kAtLeast ? bar.measured >= limit : bar.measured <= limit;
}

std::vector<Verdict> judge(const std::vector<Bars>& by_seed) {
  std::vector<Verdict> verdicts;
  for (const Bars& bars : by_seed) {
    for (std::size_t i = 0; i < bars.size(); ++i) {
      if (verdicts.size() <= i) verdicts.push_back({bars[i], {}});
      check(verdicts[i].bar.what == bars[i].what, "seeds are asked the same");
      verdicts[i].by_seed.push_back(bars[i].measured);
    }
  }
  for (Verdict& v : verdicts) v.bar.measured = combined(v.bar, v.by_seed);
  return verdicts;
}

std::vector<std::string> complaints(const std::vector<Verdict>& verdicts,
                                    const std::vector<KnownFailure>& known) {
  std::vector<std::string> all;
  for (const Verdict& v : verdicts) {
    const std::string one = complaint(v, rowOf(known, v.bar.what));
    if (!one.empty()) all.push_back(one);
  }
  for (const auto& row : known) {
    const bool asked = std::any_of(verdicts.begin(), verdicts.end(),
                                   [&](const Verdict& v) { return v.bar.what == row.bar; });
    if (!asked) all.push_back("no bar is called: " + row.bar);
  }
  return all;
}

void print(const std::vector<Verdict>& verdicts, const std::vector<KnownFailure>& known) {
  for (const Verdict& v : verdicts) {
    std::string seeds;
    for (const double value : v.by_seed) seeds += fmt::format(" {:.3g}", value);
    const bool one = v.by_seed.size() == 1;
    fmt::print("{:<76} {} {:<5.3g} {:5} {:<8.3g} {}{}\n", v.bar.what,
               v.bar.sense == Sense::kAtLeast ? ">=" : "<=", v.bar.limit,
               one                     ? ""
               : v.bar.of == Of::kMean ? "mean"
                                       : "worst",
               v.bar.measured, standing(v, rowOf(known, v.bar.what)),
               one ? "" : "; by seed" + seeds);
  }
}

void holdSeeds(const std::vector<Bars>& by_seed, const std::vector<KnownFailure>& known) {
  const auto verdicts = judge(by_seed);
  print(verdicts, known);
  for (const auto& complaint : complaints(verdicts, known)) ADD_FAILURE() << complaint;
}

void hold(const Bars& bars) { holdSeeds({bars}); }

}  // namespace perdure::test
