#include <array>
#include <charconv>
#include <cmath>
#include <set>

#include "common/config/fields.h"
#include "common/config/text.h"

namespace perdure::config {
namespace {

std::string textOf(double value) { return numberText(value); }
std::string textOf(std::int64_t value) { return std::to_string(value); }
std::string textOf(bool value) { return value ? "true" : "false"; }
std::string textOf(const std::string& value) { return quoted(value); }
template <class Value>
std::string textOf(const std::vector<Value>& values) {
  std::string text = "[";
  for (const Value& value : values) text += (text.size() > 1 ? ", " : "") + textOf(value);
  return text + "]";
}

std::string valueText(const Field& field) {
  return std::visit([](const auto* value) { return textOf(*value); }, field.target);
}

std::string limitsText(const Field& field) {
  std::string text = field.choices.empty() ? rangeText(field.range, "") : choicesText(field);
  if (field.length > 0) {
    text += (text.empty() ? "" : "; ") + std::to_string(field.length) + " values";
  }
  return text;
}

std::string commentOf(const Field& field) {
  std::string text = field.doc.text;
  if (!field.doc.unit.empty()) text += " [" + field.doc.unit + "]";
  if (const std::string limits = limitsText(field); !limits.empty()) text += " (" + limits + ")";
  if (field.required) text += " (required)";
  if (field.expert) text += " (expert)";
  return text;
}

/// Returns the YAML of the fields whose keys begin with `prefix`. Each group appears once, at the
/// place of its first field.
std::string yamlOf(const Fields& fields, const std::string& prefix, const std::string& indent) {
  std::string text;
  std::set<std::string> groups;
  for (const Field& field : fields.all()) {
    if (!field.key.starts_with(prefix)) continue;
    const std::size_t dot = field.key.find('.', prefix.size());
    const std::string name = field.key.substr(prefix.size(), dot - prefix.size());
    if (dot == std::string::npos) {
      text += indent + "# " + commentOf(field) + "\n";
      text += indent + name + ": " + valueText(field) + "\n";
    } else if (groups.insert(name).second) {
      text += indent + name + ":\n" + yamlOf(fields, prefix + name + ".", indent + "  ");
    }
  }
  return text;
}

}  // namespace

std::string choicesText(const Field& field) {
  std::string text;
  for (const std::string& choice : field.choices) text += (text.empty() ? "" : ", ") + choice;
  return text;
}

std::string numberText(double value) {
  if (std::isnan(value)) return ".nan";
  if (std::isinf(value)) return value > 0 ? ".inf" : "-.inf";
  std::array<char, 32> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return {buffer.data(), end.ptr};
}

std::string rangeText(const Range& range, const std::string& unit) {
  const bool low = std::isfinite(range.low), high = std::isfinite(range.high);
  std::string text;
  if (low && high && !range.low_open) {
    text = numberText(range.low) + " … " + numberText(range.high);
  } else {
    if (low) text = (range.low_open ? "> " : "≥ ") + numberText(range.low);
    if (high) text += (low ? ", ≤ " : "≤ ") + numberText(range.high);
  }
  return text.empty() || unit.empty() ? text : text + " " + unit;
}

std::string quoted(const std::string& text) {
  constexpr char kHex[] = "0123456789abcdef";
  std::string out = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += {'\\', c};
    } else if (c == '\n') {
      out += "\\n";
    } else if (byte < 0x20 || byte == 0x7f) {
      out += {'\\', 'x', kHex[byte >> 4], kHex[byte & 15]};
    } else {
      out += c;
    }
  }
  return out + "\"";
}

std::string toYaml(const Fields& fields) { return yamlOf(fields, "", ""); }

std::string toMarkdown(const Fields& fields) {
  std::string out = "| key | default | unit | range | meaning |\n| --- | --- | --- | --- | --- |\n";
  for (const Field& field : fields.all()) {
    out +=
        "| `" + field.key + "` | " + (field.required ? "required" : "`" + valueText(field) + "`");
    out += " | " + field.doc.unit + " | " + limitsText(field) + " | " + field.doc.text +
           (field.expert ? " (expert)" : "") + " |\n";
  }
  return out;
}

}  // namespace perdure::config
