#include <array>
#include <charconv>
#include <cmath>

#include "common/config/fields.h"
#include "common/config/text.h"

namespace perdure::config {
namespace {

template <class... F>
struct Overloaded : F... {
  using F::operator()...;
};
template <class... F>
Overloaded(F...) -> Overloaded<F...>;

std::string listText(const auto& values, auto toText) {
  std::string text = "[";
  for (const auto& value : values) text += (text.size() > 1 ? ", " : "") + toText(value);
  return text + "]";
}

std::string valueText(const Field& field) {
  return std::visit(
      Overloaded{[](const double* v) { return numberText(*v); },
                 [](const std::int64_t* v) { return std::to_string(*v); },
                 [](const bool* v) { return std::string(*v ? "true" : "false"); },
                 [](const std::string* v) { return quoted(*v); },
                 [](const std::vector<double>* v) { return listText(*v, numberText); },
                 [](const std::vector<std::string>* v) { return listText(*v, quoted); }},
      field.target);
}

std::string choicesText(const Field& field, const std::string& separator) {
  std::string text;
  for (const std::string& choice : field.choices) text += (text.empty() ? "" : separator) + choice;
  return text;
}

std::string limitsText(const Field& field) {
  std::string text = field.choices.empty() ? rangeText(field.range, "") : choicesText(field, ", ");
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

/// Groups in order of first appearance, each key once.
struct Group {
  std::string name;
  const Field* field = nullptr;
  std::vector<Group> children;

  Group& child(const std::string& child_name) {
    for (Group& c : children) {
      if (c.name == child_name) return c;
    }
    children.push_back({child_name, nullptr, {}});
    return children.back();
  }
};

Group treeOf(const Fields& fields) {
  Group root;
  for (const Field& field : fields.all()) {
    Group* group = &root;
    std::size_t begin = 0;
    for (std::size_t dot; (dot = field.key.find('.', begin)) != std::string::npos;
         begin = dot + 1) {
      group = &group->child(field.key.substr(begin, dot - begin));
    }
    group->child(field.key.substr(begin)).field = &field;
  }
  return root;
}

void print(const Group& group, const std::string& indent, std::string& out) {
  for (const Group& child : group.children) {
    if (child.field != nullptr) {
      out += indent + "# " + commentOf(*child.field) + "\n";
      out += indent + child.name + ": " + valueText(*child.field) + "\n";
    } else {
      out += indent + child.name + ":\n";
      print(child, indent + "  ", out);
    }
  }
}

}  // namespace

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

std::string toYaml(const Fields& fields) {
  std::string out;
  print(treeOf(fields), "", out);
  return out;
}

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
