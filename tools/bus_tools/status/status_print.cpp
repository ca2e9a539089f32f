#include <string>

#include "tools/bus_tools/status/status.h"

namespace perdure::tools {
namespace {

constexpr std::size_t kTextColumn = 30;

/// Returns the number of terminal columns of a UTF-8 text: one for each code point.
std::size_t widthOf(const std::string& text) {
  std::size_t n = 0;
  for (const char c : text) n += (static_cast<unsigned char>(c) & 0xC0U) != 0x80U ? 1 : 0;
  return n;
}

std::string coloured(Level level, const std::string& word, bool colour) {
  constexpr const char* kColours[] = {"\033[32m", "\033[33m", "\033[31m"};
  return colour ? kColours[static_cast<int>(level)] + word + "\033[0m" : word;
}

void print(const StatusNode& node, const std::string& stem, const std::string& branch, bool colour,
           std::string& out) {
  std::string line = stem + branch + node.name;
  line.append(kTextColumn > widthOf(line) ? kTextColumn - widthOf(line) : 1, ' ');
  std::string word = levelWord(node.level);
  const std::size_t pad = 10 - word.size();
  out += line + coloured(node.level, word, colour);
  if (!node.text.empty()) out += std::string(pad, ' ') + node.text;
  out += '\n';
  const std::string below = branch.empty() ? "" : branch == "└ " ? "  " : "│ ";
  for (const StatusNode& child : node.children) {
    const bool last = &child == &node.children.back();
    print(child, stem + below, last ? "└ " : "├ ", colour, out);
  }
}

}  // namespace

const char* levelWord(Level level) {
  constexpr const char* kWords[] = {"ok", "degraded", "failed"};
  return kWords[static_cast<int>(level)];
}

std::string toText(const StatusNode& node, bool colour) {
  std::string out;
  print(node, "", "", colour, out);
  return out;
}

std::string dumped(const nlohmann::ordered_json& json, int indent) {
  return json.dump(indent, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

nlohmann::ordered_json toJson(const StatusNode& node) {
  nlohmann::ordered_json json = {{"name", node.name}, {"level", levelWord(node.level)}};
  if (!node.text.empty()) json["text"] = node.text;
  if (node.data.is_object()) json.update(node.data);
  for (const StatusNode& child : node.children) json["children"].push_back(toJson(child));
  return json;
}

}  // namespace perdure::tools
