#include "common/base/process/held_errors.h"

#include <iostream>
#include <utility>

namespace perdure {

HeldErrors::HeldErrors(std::function<bool(const std::string&)> worth)
    : worth_(std::move(worth)), before_(std::cerr.rdbuf(this)) {}

HeldErrors::~HeldErrors() {
  std::cerr.rdbuf(before_);
  if (!line_.empty()) endLine();
}

HeldErrors::int_type HeldErrors::overflow(int_type character) {
  if (traits_type::eq_int_type(character, traits_type::eof())) return 0;
  if (character == '\n') {
    endLine();
  } else {
    line_ += traits_type::to_char_type(character);
  }
  return character;
}

void HeldErrors::endLine() {
  if (worth_(line_)) std::ostream(before_) << line_ << std::endl;
  line_.clear();
}

}  // namespace perdure
