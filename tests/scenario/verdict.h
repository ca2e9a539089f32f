// Bars of a run, their values over several seeds, and the handling of known failures. A known
// failure is tolerated as far as known_failures.csv permits. Its row must be removed as soon as the
// bar passes.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "tests/scenario/known_failures.h"

namespace perdure::test {

enum class Sense { kAtLeast, kAtMost };
/// How several seeds are combined: the worst value, or (for shares and rates) the mean.
enum class Of { kWorst, kMean };
struct Bar {
  std::string what;
  double measured = 0.0;
  Sense sense = Sense::kAtLeast;
  double limit = 0.0;
  Of of = Of::kWorst;
};
using Bars = std::vector<Bar>;
inline Bar atLeast(double limit, std::string what, double measured) {
  return {std::move(what), measured, Sense::kAtLeast, limit};
}
inline Bar atMost(double limit, std::string what, double measured) {
  return {std::move(what), measured, Sense::kAtMost, limit};
}
inline Bar onAverage(Bar bar) {
  bar.of = Of::kMean;
  return bar;
}
Bars operator+(Bars bars, const Bars& more);

/// A bar over several seeds.
struct Verdict {
  Bar bar;  ///< bar with the combined value; NaN if the value of a seed is NaN
  std::vector<double> by_seed;
  bool meets(double limit) const;
  bool meets() const { return meets(bar.limit); }
};
/// Combines the bars of each seed into one table.
std::vector<Verdict> judge(const std::vector<Bars>& by_seed);

/// Returns one sentence for each problem: a failing bar without a row, or worse than its row
/// tolerates; a passing bar with a row; a row without a bar of its name; a row whose tolerance is
/// no weaker than the bar.
std::vector<std::string> complaints(const std::vector<Verdict>& verdicts,
                                    const std::vector<KnownFailure>& known);

void print(const std::vector<Verdict>& verdicts, const std::vector<KnownFailure>& known = {});
/// Prints the table, and fails for each complaint.
void hold(const Bars& bars);
void holdSeeds(const std::vector<Bars>& by_seed, const std::vector<KnownFailure>& known = {});

}  // namespace perdure::test
