#include <fmt/format.h>
#include <pwd.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "common/base/errors.h"
#include "common/bus/security/identity.h"
#include "tools/perdure/commands.h"
#include "tools/security/authority.h"

namespace perdure::tools {
namespace {

constexpr double kAuthorityDays = 3650;

struct Request {
  std::string folder = "/etc/perdure/security", vehicle = "ego";
  double days = 365;
  Authority::Wanted wanted;
  std::vector<std::string> names;
};

/// The user of the systemd units, if root creates identities on a host with this user; else empty.
std::string serviceUser() {
  constexpr char kUser[] = "perdure";
  return geteuid() == 0 && getpwnam(kUser) != nullptr ? kUser : "";
}

bool madeAtFirst(bus::Role role) {
  return role != bus::Role::kPlayer && role != bus::Role::kSubscriber &&
         role != bus::Role::kRos2Driver;
}

void init(const Request& request) {
  Authority authority =
      Authority::create(request.folder, request.vehicle, std::max(request.days, kAuthorityDays));
  const std::string user = request.wanted.owner.empty() ? serviceUser() : request.wanted.owner;
  for (const auto& [role, role_name] : bus::roleNames()) {
    if (!madeAtFirst(role)) continue;
    const std::string name(role_name);
    const std::string owner = role == bus::Role::kOperator ? request.wanted.owner : user;
    authority.add({.name = name, .role = name, .owner = owner}, validFor(request.days));
  }
  fmt::print(
      "{0}: an authority and identities for {1}, valid for {2:g} days\n"
      "set bus.security: {0} in bus.yaml of each host, and restart all services; each host needs "
      "the folders of its own identities only, and none needs {0}/authority\n",
      request.folder, fmt::join(authority.names(), ", "), request.days);
}

void add(const Request& request) {
  Authority authority(request.folder);
  authority.add(request.wanted, validFor(request.days));
  fmt::print("{0}/{1}: the identity {1}, a {2}, valid for {3:g} days\n", request.folder,
             request.wanted.name, request.wanted.role, request.days);
}

void renew(const Request& request) {
  Authority authority(request.folder);
  const auto names = request.names.empty() ? authority.names() : request.names;
  for (const std::string& name : names) authority.renew(name, validFor(request.days));
  fmt::print(
      "renewed for {:g} days: {}\ncopy the folders to their hosts; a process takes its new "
      "identity at its next start, and until then the old one goes on to its end\n",
      request.days, fmt::join(names, ", "));
}

void revoke(const Request& request) {
  Authority authority(request.folder);
  for (const std::string& name : request.names) authority.revoke(name);
  fmt::print(
      "revoked: {}\ncopy {} of the folders to the other hosts and restart all services: a process "
      "reads it at its start only\n",
      fmt::join(request.names, ", "), bus::identity_files::kRevoked);
}

void list(const Request& request) {
  const Authority authority(request.folder);
  for (const std::string& name : authority.names()) {
    const auto identity = bus::readIdentity(request.folder + "/" + name);
    if (identity) {
      fmt::print("{:<20} {:<16} ends {}\n", name, identity->role, bus::fromNow(identity->until));
    } else {
      fmt::print("{:<20} {}\n", name, identity.error().detail);
    }
  }
}

CLI::App* subcommand(CLI::App& parent, const std::string& name, const std::string& summary,
                     const std::shared_ptr<Request>& request, void (*run)(const Request&)) {
  CLI::App* command = parent.add_subcommand(name, summary);
  command->add_option("--dir", request->folder, "folder of the identities (bus.security)")
      ->capture_default_str();
  command->callback([request, run] { run(*request); });
  return command;
}

void addDays(CLI::App& command, Request& request) {
  command.add_option("--days", request.days, "how long the identities are valid")
      ->capture_default_str()
      ->check(CLI::Range(1e-5, kAuthorityDays));
}

void addOwner(CLI::App& command, Request& request, const char* meaning) {
  command.add_option("--owner", request.wanted.owner, meaning)->type_name("USER");
}

}  // namespace

void setUpSecurity(CLI::App& security) {
  security.require_subcommand(1);
  auto request = std::make_shared<Request>();
  CLI::App* made = subcommand(security, "init",
                              "make an authority, and identities for services, recorder, operator",
                              request, &init);
  made->add_option("--vehicle", request->vehicle, "the vehicle whose topics they may use")
      ->capture_default_str();
  addDays(*made, *request);
  addOwner(*made, *request, "user of all files; else the services' are perdure's, made by root");
  CLI::App* added = subcommand(security, "add", "one more identity", request, &add);
  added
      ->add_option("role", request->wanted.role,
                   "subscriber, player, ros2_driver, or as `init` makes them")
      ->required();
  added->add_option("name", request->wanted.name, "the folder's name, for bus.identity")
      ->required();
  added->add_option("--topics", request->wanted.topics,
                    "what it reads, instead of what its role reads: objects, frame/cam0, …; of a "
                    "ros2_driver what it writes");
  addDays(*added, *request);
  addOwner(*added, *request, "user of the files");
  CLI::App* renewed = subcommand(security, "renew", "new keys and certificates, of all or of some",
                                 request, &renew);
  renewed->add_option("names", request->names, "which identities; none: all");
  addDays(*renewed, *request);
  CLI::App* revoked =
      subcommand(security, "revoke", "shut out all that a name was ever given", request, &revoke);
  revoked->add_option("names", request->names, "which identities")->required();
  subcommand(security, "list", "the identities of the folder and when they end", request, &list);
}

}  // namespace perdure::tools
