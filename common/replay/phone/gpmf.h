// GPMF, the format of GoPro's telemetry: items of key, type, size, number and values in big-endian
// order. Specification: github.com/gopro/gpmf-parser, README.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"

namespace perdure::replay::phone {

struct GpmfItem {
  std::string key;        ///< four characters
  char type = 0;          ///< of the numbers: b B s S l L j J f d; 0: contains items
  std::size_t size = 0;   ///< bytes of one sample
  std::size_t count = 0;  ///< number of samples
  std::string_view data;  ///< size × count bytes of the text given to itemsOf()
};

/// The items in a packet, or in the data of an item that contains items. Reason: gpmf_damaged (an
/// item is longer than the text).
Result<std::vector<GpmfItem>> itemsOf(std::string_view text);
/// The numbers of an item, sample after sample; none if its type is not a number.
std::vector<double> numbersOf(const GpmfItem& item);

}  // namespace perdure::replay::phone
