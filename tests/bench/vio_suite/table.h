// The suite's table, on a screen and as CSV.
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "tests/bench/vio_suite/clips.h"
#include "tests/bench/vio_suite/play.h"
#include "tests/bench/vio_suite/starts.h"

namespace perdure::bench {

class Table {
 public:
  void add(const Clip& clip, const std::string& variant, const Outcome& outcome);
  void add(const std::vector<StartRow>& starts);
  /// Rows by clip, then the means of the halves for each variant.
  void print(std::ostream& out);
  void writeCsv(std::ostream& out);

 private:
  struct Row {
    std::string clip, variant;
    Half half;
    Outcome outcome;
  };
  void sort();
  void printMeans(std::ostream& out) const;
  void printStarts(std::ostream& out) const;
  std::vector<Row> rows_;
  std::vector<StartRow> starts_;
};

}  // namespace perdure::bench
