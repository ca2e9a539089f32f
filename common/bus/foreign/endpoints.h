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
  std::string name;        ///< name on the wire, for example "rt/camera/image_raw"
  std::string type;        ///< for example "sensor_msgs::msg::dds_::Image_"
  bool reliable = true;    ///< a best-effort reader matches any writer
  bool latched = false;    ///< TRANSIENT_LOCAL
  int depth = 1;           ///< KEEP_LAST
  std::string count = {};  ///< prefix of the names of its counts; empty: the topic's name
};

/// Reads a third-party topic. Foreign readers and writers ignore their own participant, so that a
/// process does not receive the messages that it writes.
class ForeignReader : public AnyReader {
 public:
  /// `cdr` includes its header of four bytes, and stays valid while it has an owner.
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

  /// Writes `cdr`, which includes its header. If DDS cannot write it, counts and returns the
  /// reason.
  Result<void> write(std::vector<std::uint8_t> cdr);

 private:
  ddsi_sertype* type_;
};

}  // namespace perdure::bus
