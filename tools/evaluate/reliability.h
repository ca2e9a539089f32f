// Checks whether probabilities are calibrated (DeGroot and Fienberg, 1983).
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace perdure::tools {

/// A claim with its estimated probability in [0, 1], and whether it was true.
struct Claim {
  double believed = 0.0;
  bool so = false;
};

struct ReliabilityBin {
  std::size_t count = 0;
  double believed = 0.0, observed = 0.0;  ///< means; 0 if empty
};

struct Reliability {
  std::string what;
  std::vector<Claim> claims;

  /// Bins of equal width over [0, 1].
  std::vector<ReliabilityBin> bins(std::size_t count = 10) const;
  /// Expected calibration error: Σ |believed − observed| of the bins, weighted by their share of
  /// the claims.
  double calibrationError(std::size_t bins = 10) const;
  double brier() const;  ///< mean of (stated probability − outcome)²
  /// 1 − brier() / b, with b the Brier score of a constant forecast of the observed share; 0 if all
  /// claims are true or all are false.
  double skill() const;
};

/// Estimated class probabilities of an object, and its true class.
struct ClassClaim {
  std::map<std::string, double> believed;
  std::string is;
};

struct ClassReliability {
  std::string what;
  std::vector<ClassClaim> claims;

  /// Returns the claims "the most probable class is correct".
  Reliability best() const;
  double brier() const;  ///< mean of Σ_k (believed_k − is_k)², in [0, 2]
  /// 1 − brier() / b, with b the Brier score of a constant forecast of the class frequencies.
  double skill() const;
};

}  // namespace perdure::tools
