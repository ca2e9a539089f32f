// Topics of third-party programs, given by name and type. Messages are raw CDR bytes; the code that
// decodes them must check their contents.
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
  std::string name;        ///< name on the wire: "rt/camera/image_raw"
  std::string type;        ///< "sensor_msgs::msg::dds_::Image_"
  bool reliable = true;    ///< a best-effort reader matches any writer
  bool latched = false;    ///< TRANSIENT_LOCAL
  int depth = 1;           ///< KEEP_LAST
  std::string count = {};  ///< prefix of the names of its counts; empty: the topic's name
};

/// Readers and writers ignore their own participant, so that mirrored messages do not return.
class ForeignReader : public AnyReader {
 public:
  /// `cdr` includes its header of four bytes. It stays valid as long as it has an owner.
  using Handler = std::function<void(const SharedBytes& cdr)>;

  ForeignReader(const Participant& participant, const ForeignTopic& topic);

  /// Passes at most one batch to the handler, in order. Returns true if more messages may be
  /// available.
  bool drainBatch(const Handler& handler);
};

class ForeignWriter : public AnyWriter {
 public:
  ForeignWriter(const Participant& participant, const ForeignTopic& topic);
  ~ForeignWriter();

  /// `cdr` includes its header. Messages that cannot be written are counted, and the reason is
  /// returned.
  Result<void> write(std::vector<std::uint8_t> cdr);

 private:
  ddsi_sertype* type_;
};

}  // namespace perdure::bus
