#include "common/base/process/held_errors.h"

#include <iostream>
#include <utility>

namespace perdure {

HeldErrors::HeldErrors(std::function<bool(const std::string&)> worth)
    : worth_(std::move(worth)), before_(std::cerr.rdbuf(said_.rdbuf())) {}

HeldErrors::~HeldErrors() {
  std::cerr.rdbuf(before_);
  for (std::string line; std::getline(said_, line);) {
    if (worth_(line)) std::cerr << line << '\n';
  }
}

}  // namespace perdure
