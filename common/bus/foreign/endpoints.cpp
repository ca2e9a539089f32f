#include "common/bus/foreign/endpoints.h"

#include <array>

#include "common/bus/dds.h"
#include "common/bus/foreign/bytes_type.h"
#include "common/bus/sample.h"
//
#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>

namespace perdure::bus {
namespace {

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
  return created(handle, "the topic " + topic.name + " (" + topic.type + ")");
}

/// Shared memory is reserved for Perdure's own images.
QosPtr foreignQos(const ForeignTopic& topic) {
  const Qos row{.reliable = topic.reliable, .depth = topic.depth, .latched = topic.latched};
  QosPtr qos = writerQos(row, {}, {}, false);
  dds_qset_ignorelocal(qos.get(), DDS_IGNORELOCAL_PARTICIPANT);
  return qos;
}

std::shared_ptr<const Entity> foreignReader(const Participant& participant,
                                            const ForeignTopic& topic) {
  const Entity entity = foreignTopic(participant, topic);
  const QosPtr qos = foreignQos(topic);
  return participant.keep(
      created(dds_create_reader(participant.handle(), entity.handle(), qos.get(), nullptr),
              "a reader of " + topic.name));
}

std::shared_ptr<const Entity> foreignWriter(const Participant& participant,
                                            const ForeignTopic& topic, ddsi_sertype** type) {
  const Entity entity = foreignTopic(participant, topic, type);
  const QosPtr qos = foreignQos(topic);
  return participant.keep(
      created(dds_create_writer(participant.handle(), entity.handle(), qos.get(), nullptr),
              "a writer of " + topic.name));
}

std::string countOf(const ForeignTopic& topic) {
  return topic.count.empty() ? topic.name : topic.count;
}

}  // namespace

ForeignReader::ForeignReader(const Participant& participant, const ForeignTopic& topic)
    : AnyReader(countOf(topic), foreignReader(participant, topic)) {}

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

ForeignWriter::ForeignWriter(const Participant& participant, const ForeignTopic& topic)
    : AnyWriter(countOf(topic), foreignWriter(participant, topic, &type_)) {}

ForeignWriter::~ForeignWriter() { ddsi_sertype_unref(type_); }

Result<void> ForeignWriter::write(std::vector<std::uint8_t> cdr) {
  ddsi_serdata* message = messageOf(type_, std::move(cdr));
  return outcome("write",
                 message == nullptr ? DDS_RETCODE_BAD_PARAMETER : dds_writecdr(handle(), message));
}

}  // namespace perdure::bus
