#include "services/gateway/web/guard.h"

#include <arpa/inet.h>

#include <algorithm>

namespace perdure::gateway::web {
namespace {

char lowered(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

std::string lower(std::string_view text) {
  std::string result(text);
  std::ranges::transform(result, result.begin(), lowered);
  return result;
}

/// Returns whether a and b are equal, in a time that depends only on the length of `a`.
bool sameSecret(std::string_view a, std::string_view b) {
  unsigned differs = a.size() == b.size() ? 0U : 1U;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const char other = b.empty() ? '\0' : b[i % b.size()];
    differs |= static_cast<unsigned>(static_cast<unsigned char>(a[i] ^ other));
  }
  return differs == 0;
}

/// Returns the value of token= in the query of `target`, or "". Percent-encoding is not decoded,
/// because tokens do not need it.
std::string_view tokenIn(std::string_view target) {
  constexpr std::string_view kName = "token=";
  const std::size_t question = target.find('?');
  if (question == std::string_view::npos) return {};
  for (std::string_view rest = target.substr(question + 1); !rest.empty();) {
    const std::size_t end = std::min(rest.find('&'), rest.size());
    const std::string_view pair = rest.substr(0, end);
    if (pair.starts_with(kName)) return pair.substr(kName.size());
    rest.remove_prefix(std::min(rest.size(), end + 1));
  }
  return {};
}

}  // namespace

bool isLoopback(std::string_view address) {
  in_addr parsed{};
  const bool numbers = inet_pton(AF_INET, std::string(address).c_str(), &parsed) == 1;
  return address == "localhost" || address == "::1" ||
         (numbers && ntohl(parsed.s_addr) >> 24U == 127);
}

std::string hostName(std::string_view header) {
  if (header.starts_with('[')) {
    const std::size_t end = header.find(']');
    return end == std::string_view::npos ? std::string() : lower(header.substr(1, end - 1));
  }
  return lower(header.substr(0, header.find(':')));
}

std::string_view pathOf(std::string_view target) { return target.substr(0, target.find('?')); }

Result<void> Guard::checkHost(std::string_view host) const {
  const std::string name = hostName(host);
  const auto& allowed = options_.allowed_hosts;
  const bool listed =
      std::ranges::any_of(allowed, [&](const auto& one) { return lower(one) == name; });
  // If a token is configured, any name is accepted, because a foreign page does not have the token.
  const bool guarded = !options_.token.empty() && !name.empty();
  if (guarded || isLoopback(name) || name == options_.address || listed) return {};
  return fail("host_refused", "the Host header names \"" + name.substr(0, 64) +
                                  "\"; http.allowed_hosts lists the names of this gateway");
}

Result<void> Guard::checkOrigin(std::string_view origin, std::string_view host) const {
  if (origin.empty()) return {};
  const auto& allowed = options_.allowed_origins;
  const bool listed =
      std::ranges::any_of(allowed, [&](const auto& one) { return lower(one) == lower(origin); });
  const std::size_t scheme = origin.find("://");
  const bool ours = scheme != std::string_view::npos && !host.empty() &&
                    (origin.starts_with("http://") || origin.starts_with("https://")) &&
                    lower(origin.substr(scheme + 3)) == lower(host);
  if (listed || ours) return {};
  return fail("origin_refused", "the page is from " + std::string(origin.substr(0, 128)) +
                                    "; http.allowed_origins lists who may connect");
}

Result<void> Guard::checkToken(std::string_view target, std::string_view authorization) const {
  if (options_.token.empty()) return {};
  constexpr std::string_view kBearer = "Bearer ";
  std::string_view given = tokenIn(target);
  if (authorization.starts_with(kBearer)) given = authorization.substr(kBearer.size());
  if (sameSecret(given, options_.token) && !given.empty()) return {};
  return fail("token_wrong", "give the token of http.token: ?token=… behind the address");
}

}  // namespace perdure::gateway::web
