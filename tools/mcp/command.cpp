// `perdure mcp`: the MCP server on standard input and output, a message a line.
#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <functional>
#include <iostream>
#include <memory>

#include "common/base/errors.h"
#include "services/gateway/mcp/bus_map.h"
#include "services/gateway/mcp/protocol.h"
#include "tools/bus_tools/common.h"
#include "tools/mcp/file_map.h"
#include "tools/perdure/commands.h"

namespace perdure::tools {
namespace {

namespace mcp = gateway::mcp;

constexpr std::size_t kLongestLine = 1 << 20;

struct Request {
  bus::Options bus;
  std::string map;
  bool allow_corrections = false;
};

/// Appends bytes of standard input. Calls `idle` each second until some arrive. Returns false at
/// the end of the input.
bool readMore(std::string& pending, const std::function<void()>& idle) {
  constexpr int kSecond_ms = 1000;
  pollfd input{STDIN_FILENO, POLLIN, 0};
  while (::poll(&input, 1, kSecond_ms) == 0) idle();
  char bytes[4096];
  const ssize_t count = ::read(STDIN_FILENO, bytes, sizeof bytes);
  if (count < 0 && errno == EINTR) return true;
  if (count > 0) pending.append(bytes, static_cast<std::size_t>(count));
  return count > 0;
}

void answerLine(std::string_view line, mcp::Map& map) {
  if (line.find_first_not_of(" \t\r") == std::string_view::npos) return;
  const mcp::Answer answer = mcp::answer(line, map);
  if (!answer.text.empty()) std::cout << answer.text << '\n' << std::flush;
}

void serve(mcp::Map& map, const std::function<void()>& idle) {
  std::string pending;
  bool more = true;
  while (more && std::cout) {
    more = readMore(pending, idle);
    if (!more && !pending.empty()) pending += '\n';
    std::size_t begin = 0;
    for (std::size_t end; (end = pending.find('\n', begin)) != std::string::npos; begin = end + 1) {
      answerLine(std::string_view(pending).substr(begin, end - begin), map);
    }
    pending.erase(0, begin);
    if (pending.size() > kLongestLine) {
      throw StartupError(ExitCode::kData,
                         "A message is longer than 1 MiB or has no line end; MCP's stdio transport "
                         "has one message a line.");
    }
  }
}

void run(const Request& request) {
  if (!request.map.empty()) {
    FileMap map(request.map, request.allow_corrections);
    return serve(map, [] {});
  }
  const bus::Domain domain(request.bus);
  const bus::Participant participant(domain, "perdure mcp");
  mcp::BusMap map(participant, request.allow_corrections);
  serve(map, [&] { map.follow(); });
}

}  // namespace

void setUpMcp(CLI::App& command) {
  auto request = std::make_shared<Request>();
  command
      .add_option("--map", request->map,
                  "a map's file or its folder; without it, the running services are asked")
      ->type_name("PATH");
  command.add_flag("--allow-corrections", request->allow_corrections,
                   "the client may correct the map, and withdraw corrections");
  addBusOptions(command, request->bus);
  command.callback([request] { run(*request); });
}

}  // namespace perdure::tools
