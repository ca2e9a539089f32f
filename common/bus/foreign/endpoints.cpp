#include "common/bus/foreign/endpoints.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>

#include "common/bus/dds.h"
#include "common/bus/sample.h"
//
#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>
#include <dds/ddsi/q_radmin.h>

namespace perdure::bus {
namespace {

constexpr std::size_t kHead = 4;  // CDR header

struct BytesType : ddsi_sertype {};

struct BytesMessage : ddsi_serdata {
  BytesMessage(const ddsi_sertype* of, ddsi_serdata_kind of_kind, std::vector<std::uint8_t> cdr)
      : ddsi_serdata{}, size(static_cast<std::uint32_t>(cdr.size())) {
    ddsi_serdata_init(this, of, of_kind);
    cdr.resize((cdr.size() + 3) / 4 * 4);  // Cyclone sends multiples of four bytes
    bytes = std::make_shared<const std::vector<std::uint8_t>>(std::move(cdr));
  }
  std::uint32_t size;  // size without the padding of the last word
  std::shared_ptr<const std::vector<std::uint8_t>> bytes;
};

const BytesMessage& in(const ddsi_serdata* data) { return *static_cast<const BytesMessage*>(data); }

ddsi_serdata* made(const ddsi_sertype* type, ddsi_serdata_kind kind,
                   std::vector<std::uint8_t> cdr) {
  return cdr.size() < kHead && kind == SDK_DATA ? nullptr
                                                : new BytesMessage(type, kind, std::move(cdr));
}

ddsi_serdata* fromFragments(const ddsi_sertype* type, ddsi_serdata_kind kind,
                            const nn_rdata* fragment, std::size_t size) {
  std::vector<std::uint8_t> cdr;
  cdr.reserve(size + 3);
  for (; fragment != nullptr; fragment = fragment->nextfrag) {
    if (fragment->min > cdr.size()) return nullptr;
    const std::size_t end = std::min<std::size_t>(fragment->maxp1, size);
    if (end <= cdr.size()) continue;  // fragments may overlap
    const auto* payload = reinterpret_cast<const std::uint8_t*>(fragment->rmsg + 1) +
                          NN_RDATA_PAYLOAD_OFF(fragment) - fragment->min;
    cdr.insert(cdr.end(), payload + cdr.size(), payload + end);
  }
  return cdr.size() == size ? made(type, kind, std::move(cdr)) : nullptr;
}

ddsi_serdata* fromPieces(const ddsi_sertype* type, ddsi_serdata_kind kind, ddsrt_msg_iovlen_t n,
                         const ddsrt_iovec_t* pieces, std::size_t size) {
  std::vector<std::uint8_t> cdr;
  cdr.reserve(size + 3);
  for (std::size_t i = 0; i < static_cast<std::size_t>(n) && cdr.size() < size; ++i) {
    const auto* from = static_cast<const std::uint8_t*>(pieces[i].iov_base);
    cdr.insert(cdr.end(), from, from + std::min(pieces[i].iov_len, size - cdr.size()));
  }
  return made(type, kind, std::move(cdr));
}

/// Returns an empty key: without a key, all messages belong to one instance.
ddsi_serdata* keyOf(const ddsi_sertype* type) { return made(type, SDK_KEY, {}); }

ddsi_serdata_ops messageOps() {
  ddsi_serdata_ops ops{};
  ops.eqkey = [](const ddsi_serdata*, const ddsi_serdata*) { return true; };
  ops.get_size = [](const ddsi_serdata* d) { return in(d).size; };
  ops.from_ser = &fromFragments;
  ops.from_ser_iov = &fromPieces;
  ops.from_keyhash = [](const ddsi_sertype* type, const ddsi_keyhash*) { return keyOf(type); };
  ops.from_sample = [](const ddsi_sertype*, ddsi_serdata_kind, const void*) -> ddsi_serdata* {
    return nullptr;
  };
  ops.to_ser = [](const ddsi_serdata* d, std::size_t off, std::size_t n, void* to) {
    std::memcpy(to, in(d).bytes->data() + off, n);
  };
  ops.to_ser_ref = [](const ddsi_serdata* d, std::size_t off, std::size_t n, ddsrt_iovec_t* to) {
    to->iov_base = const_cast<std::uint8_t*>(in(d).bytes->data() + off);
    to->iov_len = n;
    return ddsi_serdata_ref(d);
  };
  ops.to_ser_unref = [](ddsi_serdata* d, const ddsrt_iovec_t*) { ddsi_serdata_unref(d); };
  ops.to_sample = [](const ddsi_serdata*, void*, void**, void*) { return false; };
  ops.to_untyped = [](const ddsi_serdata* d) {
    ddsi_serdata* key = keyOf(d->type);
    key->type = nullptr;
    return key;
  };
  ops.untyped_to_sample = [](const ddsi_sertype*, const ddsi_serdata*, void*, void**, void*) {
    return true;
  };
  ops.free = [](ddsi_serdata* d) { delete static_cast<BytesMessage*>(d); };
  ops.print = [](const ddsi_sertype*, const ddsi_serdata*, char* text, std::size_t n) {
    if (n > 0) text[0] = '\0';
    return std::size_t{0};
  };
  ops.get_keyhash = [](const ddsi_serdata*, ddsi_keyhash* to, bool) {
    std::memset(to, 0, sizeof *to);
  };
  return ops;
}

ddsi_sertype_ops typeOps() {
  ddsi_sertype_ops ops{};
  ops.version = ddsi_sertype_v0;
  ops.free = [](ddsi_sertype* type) {
    ddsi_sertype_fini(type);
    delete static_cast<BytesType*>(type);
  };
  // C samples do not exist for this type: messages are taken and written as bytes.
  ops.zero_samples = [](const ddsi_sertype*, void*, std::size_t) {};
  ops.realloc_samples = [](void**, const ddsi_sertype*, void*, std::size_t, std::size_t) {};
  ops.free_samples = [](const ddsi_sertype*, void**, std::size_t, dds_free_op_t) {};
  ops.equal = [](const ddsi_sertype*, const ddsi_sertype*) { return true; };
  ops.hash = [](const ddsi_sertype*) { return std::uint32_t{0}; };
  return ops;
}

/// Returns a DDS type without a key, in XCDR1, that matches other types by name. The caller owns
/// one reference to it.
ddsi_sertype* makeBytesType(const std::string& name) {
  static const ddsi_serdata_ops kMessages = messageOps();
  static const ddsi_sertype_ops kType = typeOps();
  auto* type = new BytesType{};
  ddsi_sertype_init(type, name.c_str(), &kType, &kMessages, true);
  type->allowed_data_representation = DDS_DATA_REPRESENTATION_FLAG_XCDR1;
  return type;
}

/// Returns a message of a type from makeBytesType(). The caller owns one reference to it.
ddsi_serdata* messageOf(const ddsi_sertype* type, std::vector<std::uint8_t> cdr) {
  return made(type, SDK_DATA, std::move(cdr));
}

/// Returns the bytes of a message, including the header. They stay valid while they have an owner.
SharedBytes bytesOf(const ddsi_serdata* message) {
  const BytesMessage& bytes = in(message);
  return {bytes.bytes, std::span(*bytes.bytes).first(bytes.size)};
}

/// Creates the topic. If `keep` is given, it receives the type, and the caller owns one reference.
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

/// Returns a QoS without shared memory, which only Perdure's own images use.
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
