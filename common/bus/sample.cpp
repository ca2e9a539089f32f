#include "common/bus/sample.h"

#include "common/bus/dds.h"
//
#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_shm_transport.h>

namespace perdure::bus {
namespace {

constexpr std::uint32_t kHeader = 4;  // CDR header of messages from the network

/// One reference to Cyclone's serialised message, or to a chunk of shared memory.
class Held {
 public:
  Held(std::shared_ptr<const Entity> reader, ddsi_serdata* data)
      : reader_(std::move(reader)), data_(data) {
    if (inSharedMemory()) return;
    ddsi_serdata_to_ser_ref(data_, kHeader, ddsi_serdata_size(data_) - kHeader, &part_);
  }
  ~Held() {
    if (!inSharedMemory()) ddsi_serdata_to_ser_unref(data_, &part_);
    ddsi_serdata_unref(data_);
  }
  Held(const Held&) = delete;
  Held& operator=(const Held&) = delete;

  bool inSharedMemory() const { return data_->iox_chunk != nullptr; }
  std::span<const std::uint8_t> cdr() const {
    if (!inSharedMemory()) return {static_cast<const std::uint8_t*>(part_.iov_base), part_.iov_len};
    const iceoryx_header_t* header = iceoryx_header_from_chunk(data_->iox_chunk);
    // Only types of fixed size, which frames are not, are stored in their C layout.
    if (header->shm_data_state != IOX_CHUNK_CONTAINS_SERIALIZED_DATA) return {};
    return {static_cast<const std::uint8_t*>(data_->iox_chunk), header->data_size};
  }

 private:
  const std::shared_ptr<const Entity> reader_;  // Cyclone returns chunks through it
  ddsi_serdata* const data_;
  ddsrt_iovec_t part_{};
};

}  // namespace

std::vector<RawSample> takeInPlace(const std::shared_ptr<const Entity>& reader, std::size_t most) {
  std::vector<ddsi_serdata*> data(most);
  std::vector<dds_sample_info_t> infos(most);
  const dds_return_t n = dds_takecdr(reader->handle(), data.data(),
                                     static_cast<std::uint32_t>(most), infos.data(), DDS_ANY_STATE);
  std::vector<RawSample> samples;
  for (std::size_t i = 0; n > 0 && i < static_cast<std::size_t>(n); ++i) {
    auto held = std::make_shared<const Held>(reader, data[i]);
    if (infos[i].valid_data) samples.push_back({held->cdr(), held->inSharedMemory(), held});
  }
  return samples;
}

}  // namespace perdure::bus
