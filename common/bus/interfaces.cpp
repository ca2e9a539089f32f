#include "common/bus/interfaces.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>

#include <functional>
#include <memory>
#include <set>

namespace perdure::bus {
namespace {

void eachAddress(const std::function<void(const ifaddrs&)>& visit) {
  constexpr unsigned kUp = IFF_UP | IFF_RUNNING;
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) != 0) return;
  const std::unique_ptr<ifaddrs, decltype(&freeifaddrs)> owned(all, &freeifaddrs);
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    const bool ipv4 = one->ifa_addr != nullptr && one->ifa_addr->sa_family == AF_INET;
    if (ipv4 && (one->ifa_flags & kUp) == kUp) visit(*one);
  }
}

}  // namespace

std::string interfacesUp() {
  constexpr std::size_t kMost = 4;  // MAX_XMIT_CONNS of Cyclone 0.10
  std::set<std::string> known{"lo"};
  std::string names = "lo";
  eachAddress([&](const ifaddrs& one) {
    if (known.size() < kMost && known.insert(one.ifa_name).second)
      names += std::string(",") + one.ifa_name;
  });
  return names;
}

std::string addressOf(const std::string& interface) {
  std::string address = interface;
  eachAddress([&](const ifaddrs& one) {
    char text[INET_ADDRSTRLEN] = "";
    const auto* internet = reinterpret_cast<const sockaddr_in*>(one.ifa_addr);
    if (address != interface || interface != one.ifa_name) return;
    if (inet_ntop(AF_INET, &internet->sin_addr, text, sizeof text) != nullptr) address = text;
  });
  return address;
}

}  // namespace perdure::bus
