// Topics of programs that are not ours, by name and type alone: messages are the bytes of their
// CDR, whatever they are. What they say is checked by whoever reads them.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/base/shared_bytes.h"
#include "common/bus/endpoint.h"

struct ddsi_sertype;

namespace perdure::bus {

struct ForeignTopic {
  std::string name;        ///< on the wire: "rt/camera/image_raw"
  std::string type;        ///< "sensor_msgs::msg::dds_::Image_"
  bool reliable = true;    ///< a reader that is not takes what any writer offers
  bool latched = false;    ///< TRANSIENT_LOCAL
  int depth = 1;           ///< KEEP_LAST
  std::string count = {};  ///< begins the names of its counts; empty: the topic's name
};

/// Neither hears its own participant: what is mirrored does not come back.
class ForeignReader : public Endpoint {
 public:
  /// `cdr` with its head of four bytes; it stays as long as it is held.
  using Handler = std::function<void(const SharedBytes& cdr)>;

  ForeignReader(const Participant& participant, const ForeignTopic& topic);

  std::size_t matched() const;
  /// Hands over at most one batch, in its order; true where there may be more.
  bool drainBatch(const Handler& handler);
  /// Adds <count>_incompatible_qos, _sample_lost.
  void report(ReasonCounts& counts) const;
};

class ForeignWriter : public Endpoint {
 public:
  ForeignWriter(const Participant& participant, const ForeignTopic& topic);
  ~ForeignWriter();

  std::size_t matched() const;
  /// `cdr` with its head. What cannot be written is counted and told.
  Result<void> write(std::vector<std::uint8_t> cdr);
  /// Adds <count>_write_<error>, _incompatible_qos.
  void report(ReasonCounts& counts) const;

 private:
  ddsi_sertype* type_;
};

}  // namespace perdure::bus
