// Errors expected at run time (late, malformed, gated out) are values with a reason.
#pragma once

#include <fmt/core.h>

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <utility>

namespace perdure {

/// The reason for a failure. `code` is a short, stable snake_case word that Health counts; `detail`
/// states how to fix the cause.
struct Reason {
  std::string code;
  std::string detail;
};

template <class T>
using Result = tl::expected<T, Reason>;

inline tl::unexpected<Reason> fail(std::string_view code, std::string_view detail = {}) {
  return tl::unexpected<Reason>(Reason{std::string(code), std::string(detail)});
}

template <class First, class... More>
tl::unexpected<Reason> fail(std::string_view code, fmt::format_string<First, More...> detail,
                            First&& first, More&&... more) {
  return fail(code, fmt::format(detail, std::forward<First>(first), std::forward<More>(more)...));
}

/// Counts of reasons since the start, published in Health. The map is ordered, so that the output
/// is repeatable.
class ReasonCounts {
 public:
  void add(const Reason& reason, std::uint64_t count = 1) { add(reason.code, count); }
  void add(std::string_view code, std::uint64_t count = 1) { counts_[std::string(code)] += count; }
  void add(const ReasonCounts& more) {
    for (const auto& [code, count] : more.all()) add(code, count);
  }
  std::uint64_t of(const std::string& code) const {
    const auto it = counts_.find(code);
    return it == counts_.end() ? 0 : it->second;
  }
  const std::map<std::string, std::uint64_t>& all() const { return counts_; }

 private:
  std::map<std::string, std::uint64_t> counts_;
};

}  // namespace perdure
