#include "common/bus/cdr_reader.h"

#include <array>

#include "common/bus/dds.h"
#include "common/bus/sample.h"
//
#include <dds/ddsi/ddsi_serdata.h>

namespace perdure::bus {
namespace {

/// The serialised message in Cyclone's memory, contiguous.
class Serialised {
 public:
  explicit Serialised(ddsi_serdata* data) : data_(data) {
    ddsi_serdata_to_ser_ref(data_, 0, ddsi_serdata_size(data_), &part_);
  }
  ~Serialised() {
    ddsi_serdata_to_ser_unref(data_, &part_);
    ddsi_serdata_unref(data_);
  }
  Serialised(const Serialised&) = delete;
  Serialised& operator=(const Serialised&) = delete;
  std::span<const std::uint8_t> bytes() const {
    return {static_cast<const std::uint8_t*>(part_.iov_base), part_.iov_len};
  }

 private:
  ddsi_serdata* const data_;
  ddsrt_iovec_t part_{};
};

}  // namespace

bool CdrReader::drainBatch(const Handler& handler) {
  std::array<ddsi_serdata*, kBatch> data{};
  std::array<dds_sample_info_t, kBatch> infos{};
  const dds_return_t n = dds_takecdr(handle(), data.data(), kBatch, infos.data(), DDS_ANY_STATE);
  for (std::size_t i = 0; n > 0 && i < static_cast<std::size_t>(n); ++i) {
    const Serialised sample(data[i]);
    if (infos[i].valid_data) handler({sample.bytes(), infos[i].source_timestamp});
  }
  return n == static_cast<dds_return_t>(kBatch);
}

}  // namespace perdure::bus
