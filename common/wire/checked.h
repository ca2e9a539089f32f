// The first refusal in a message, with the path of its field. Internal to common/wire.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/wire/checks.h"

namespace perdure::wire {

class Checked {
 public:
  bool failed() const { return reason_.has_value(); }
  const Reason& reason() const { return reason_.value(); }

  /// `holds` is called only for values that were read.
  template <class Predicate>
  void ensure(const char* name, const char* code, Predicate holds) {
    if (!failed() && !holds()) refuse(name, code);
  }

 protected:
  void refuse(const char* name, const char* code) {
    if (failed()) return;
    std::string path;
    for (const Step& step : path_) {
      path += step.name;
      path += step.index < 0 ? "." : "[" + std::to_string(step.index) + "].";
    }
    reason_ = Reason{code, path + name};
  }

  bool checkNumber(const char* name, double value, const Limits& limits) {
    if (inside(value, limits)) return true;
    refuse(name, std::isfinite(value) ? "out_of_range" : "not_finite");
    return false;
  }

  void checkTime(const char* name, std::int64_t ns) {
    if (!isTime(ns)) refuse(name, "out_of_range");
  }

  void checkUnit(const char* name, double norm) {
    if (!std::isfinite(norm)) return refuse(name, "not_finite");
    if (std::abs(norm - 1.0) > kUnitTolerance) refuse(name, "bad_rotation");
  }

  template <class Matrix>
  void checkMatrix(const char* name, const Matrix& m, const Limits& limits) {
    for (Eigen::Index i = 0; i < m.size(); ++i) {
      if (!checkNumber(name, m(i % m.rows(), i / m.rows()), limits)) return;
    }
  }

  template <class Matrix>
  void checkSymmetric(const char* name, const Matrix& m) {
    checkMatrix(name, m, kMatrixEntry);
    if (!failed() && !isSemiDefinite(m)) refuse(name, "bad_covariance");
  }

  template <class Matrix>
  void checkCovariance(const char* name, const Matrix& m) {
    checkMatrix(name, m, kMatrixEntry);
    if (!failed() && !isDefinite(m)) refuse(name, "bad_covariance");
  }

  void checkText(const char* name, std::string_view text, std::size_t longest) {
    if (text.size() > longest) return refuse(name, "over_bound");
    if (!isText(text)) refuse(name, "bad_text");
  }

  bool checkCount(const char* name, std::size_t count, std::size_t most) {
    if (count > most) refuse(name, "over_bound");
    return count <= most;
  }

  /// Visits one part of the message under its name.
  template <class Visit>
  void under(const char* name, long index, Visit visit) {
    path_.push_back({name, index});
    visit();
    path_.pop_back();
  }

 private:
  struct Step {
    const char* name;
    long index;  // -1: not a list element
  };
  std::vector<Step> path_;
  std::optional<Reason> reason_;
};

}  // namespace perdure::wire
