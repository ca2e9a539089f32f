#include "common/bus/foreign/endpoints.h"

#include <array>

#include "common/base/errors.h"
#include "common/bus/dds.h"
#include "common/bus/foreign/bytes_type.h"
#include "common/bus/sample.h"
//
#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>

namespace perdure::bus {
namespace {

Entity made(dds_entity_t handle, const std::string& what) {
  if (handle > 0) return Entity(handle);
  throw StartupError(ExitCode::kUnavailable,
                     "DDS cannot create " + what + ": " + dds_strretcode(-handle));
}

/// The topic, and its type. If `keep` is given, the caller owns one reference to the type.
Entity foreignTopic(const Participant& participant, const ForeignTopic& topic,
                    ddsi_sertype** keep = nullptr) {
  ddsi_sertype* type = makeBytesType(topic.type);
  const dds_entity_t handle = dds_create_topic_sertype(participant.handle(), topic.name.c_str(),
                                                       &type, nullptr, nullptr, nullptr);
  if (handle < 0) {
    ddsi_sertype_unref(type);
  } else if (keep != nullptr) {
    *keep = ddsi_sertype_ref(type);
  }
  return made(handle, "the topic " + topic.name + " (" + topic.type + ")");
}

QosPtr foreignQos(const ForeignTopic& topic) {
  constexpr dds_duration_t kMaxBlocking = DDS_MSECS(100);
  QosPtr qos(dds_create_qos());
  dds_qset_reliability(qos.get(),
                       topic.reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT,
                       kMaxBlocking);
  dds_qset_durability(qos.get(),
                      topic.latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, topic.depth);
  dds_qset_writer_data_lifecycle(qos.get(), false);
  // Shared memory is reserved for Perdure's own images.
  dds_qset_ignorelocal(qos.get(), DDS_IGNORELOCAL_PARTICIPANT);
  if (topic.latched) {
    dds_qset_durability_service(qos.get(), 0, DDS_HISTORY_KEEP_LAST, topic.depth,
                                DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  }
  return qos;
}

std::shared_ptr<const Entity> foreignReader(const Participant& participant,
                                            const ForeignTopic& topic) {
  const Entity entity = foreignTopic(participant, topic);
  const QosPtr qos = foreignQos(topic);
  return participant.keep(
      made(dds_create_reader(participant.handle(), entity.handle(), qos.get(), nullptr),
           "a reader of " + topic.name));
}

std::shared_ptr<const Entity> foreignWriter(const Participant& participant,
                                            const ForeignTopic& topic, ddsi_sertype** type) {
  const Entity entity = foreignTopic(participant, topic, type);
  const QosPtr qos = foreignQos(topic);
  return participant.keep(
      made(dds_create_writer(participant.handle(), entity.handle(), qos.get(), nullptr),
           "a writer of " + topic.name));
}

std::string countOf(const ForeignTopic& topic) {
  return topic.count.empty() ? topic.name : topic.count;
}

}  // namespace

ForeignReader::ForeignReader(const Participant& participant, const ForeignTopic& topic)
    : Endpoint(countOf(topic), foreignReader(participant, topic)) {}

std::size_t ForeignReader::matched() const { return matchedWriters(handle()); }

bool ForeignReader::drainBatch(const Handler& handler) {
  std::array<ddsi_serdata*, kBatch> data{};
  std::array<dds_sample_info_t, kBatch> infos{};
  const dds_return_t n = dds_takecdr(handle(), data.data(), kBatch, infos.data(), DDS_ANY_STATE);
  for (std::size_t i = 0; n > 0 && i < static_cast<std::size_t>(n); ++i) {
    const SharedBytes bytes = bytesOf(data[i]);
    ddsi_serdata_unref(data[i]);
    if (infos[i].valid_data) handler(bytes);
  }
  return n == static_cast<dds_return_t>(kBatch);
}

void ForeignReader::report(ReasonCounts& counts) const {
  add(counts, "incompatible_qos", writersWithOtherQos(handle()));
  add(counts, "sample_lost", samplesLost(handle()));
}

ForeignWriter::ForeignWriter(const Participant& participant, const ForeignTopic& topic)
    : Endpoint(countOf(topic), foreignWriter(participant, topic, &type_)) {}

ForeignWriter::~ForeignWriter() { ddsi_sertype_unref(type_); }

std::size_t ForeignWriter::matched() const { return matchedReaders(handle()); }

Result<void> ForeignWriter::write(std::vector<std::uint8_t> cdr) {
  ddsi_serdata* message = messageOf(type_, std::move(cdr));
  const dds_return_t code =
      message == nullptr ? DDS_RETCODE_BAD_PARAMETER : dds_writecdr(handle(), message);
  if (code == DDS_RETCODE_OK) return {};
  const Reason reason{code == DDS_RETCODE_TIMEOUT ? "timeout" : "error_" + std::to_string(-code),
                      std::string("DDS: ") + dds_strretcode(-code)};
  count("write", reason);
  return tl::unexpected(reason);
}

void ForeignWriter::report(ReasonCounts& counts) const {
  addRefusals(counts);
  add(counts, "incompatible_qos", readersWithOtherQos(handle()));
}

}  // namespace perdure::bus
