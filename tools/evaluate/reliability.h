// Whether probabilities are true: of all that was believed with .8, eight in ten should be so
// (DeGroot and Fienberg, "The Comparison and Evaluation of Forecasters", 1983).
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace perdure::tools {

/// What was believed with a probability in [0, 1], and whether it was so.
struct Claim {
  double believed = 0.0;
  bool so = false;
};

struct ReliabilityBin {
  std::size_t count = 0;
  double believed = 0.0, observed = 0.0;  ///< means; 0 of none
};

struct Reliability {
  std::string what;
  std::vector<Claim> claims;

  /// Of equal width over [0, 1].
  std::vector<ReliabilityBin> bins(std::size_t count = 10) const;
  /// Expected calibration error: Σ |believed − observed| of the bins by their share of the claims.
  double calibrationError(std::size_t bins = 10) const;
  double brier() const;  ///< mean of (believed − so)²
  /// 1 − brier over that of one who always says the share that is so; 0 where all is so, or none.
  double skill() const;
};

/// A probability for each class that was thought of, and the one that it was.
struct ClassClaim {
  std::map<std::string, double> believed;
  std::string is;
};

struct ClassReliability {
  std::string what;
  std::vector<ClassClaim> claims;

  /// The most probable class of each, and whether it was that.
  Reliability best() const;
  double brier() const;  ///< mean of Σ_k (believed_k − is_k)², in [0, 2]
  /// 1 − brier over that of one who always says how frequent the classes are.
  double skill() const;
};

}  // namespace perdure::tools
