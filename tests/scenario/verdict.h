// Bars that a run is held to, what several seeds make of them, and what follows where a bar is
// known to fail: tolerated as far as known_failures.csv says, and to be taken out of it as soon as
// it passes.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "tests/scenario/known_failures.h"

namespace perdure::test {

enum class Sense { kAtLeast, kAtMost };
/// Of several seeds: the worst, or (of shares and rates) the mean.
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
  Bar bar;  ///< with what is held against the limit; not a number where a seed's is none
  std::vector<double> by_seed;
  bool meets(double limit) const;
  bool meets() const { return meets(bar.limit); }
};
/// The same bars of each seed as one table.
std::vector<Verdict> judge(const std::vector<Bars>& by_seed);

/// What is not as it should be, one sentence each: a bar that fails and has no row, or is worse
/// than its row tolerates; one that passes and has a row; a row that no bar is called like; a row
/// that tolerates nothing, for the bar itself asks no more.
std::vector<std::string> complaints(const std::vector<Verdict>& verdicts,
                                    const std::vector<KnownFailure>& known);

void print(const std::vector<Verdict>& verdicts, const std::vector<KnownFailure>& known = {});
/// Prints the table, and fails for each complaint.
void hold(const Bars& bars);
void holdSeeds(const std::vector<Bars>& by_seed, const std::vector<KnownFailure>& known = {});

}  // namespace perdure::test
