#include "common/bus/endpoint.h"

#include <algorithm>
#include <array>
#include <cstdint>

#include "common/base/check.h"
#include "common/base/errors.h"
#include "common/bus/dds.h"
#include "common/bus/domain.h"
#include "common/bus/sample.h"
#include "common/wire/frame_in_place.h"
//
#include <dds/ddsi/ddsi_serdata.h>

namespace perdure::bus {
namespace {

dds_duration_t duration(double seconds) {
  return seconds > 0 ? static_cast<dds_duration_t>(seconds * 1e9) : DDS_INFINITY;
}

/// Returns a QoS whose endpoints match only each other. Manual liveliness excludes shared memory.
QosPtr privateQos() {
  QosPtr qos(dds_create_qos());
  dds_qset_partition1(qos.get(), "perdure/size");
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_liveliness(qos.get(), DDS_LIVELINESS_MANUAL_BY_TOPIC, DDS_INFINITY);
  return qos;
}

std::size_t sizeOf(const ddsi_sertype*, const void* sample) {
  return wire::sizeInPlace(*static_cast<const perdure_msg_Frame*>(sample));
}

/// Cyclone 0.10.2 finds the size of a message in shared memory by serialising it with its pixels,
/// and discards the result. This call makes the topic's type compute the size instead. `topic` must
/// be a topic of frames. The call has no effect if Cyclone behaves differently than expected.
void tellSizesOfFrames(std::int32_t participant, std::int32_t topic) {
  const QosPtr qos = privateQos();
  const Entity reader(dds_create_reader(participant, topic, qos.get(), nullptr));
  const Entity writer(dds_create_writer(participant, topic, qos.get(), nullptr));
  perdure_msg_Frame sample{};
  char none[] = "";
  sample.camera = none;
  ddsi_serdata* data = nullptr;
  dds_sample_info_t info;
  // A message to a reader of the same process arrives before dds_write() returns. The message
  // refers to the type.
  if (dds_write(writer.handle(), &sample) != DDS_RETCODE_OK ||
      dds_takecdr(reader.handle(), &data, 1, &info, DDS_ANY_STATE) != 1) {
    return;
  }
  auto* type = const_cast<ddsi_sertype*>(data->type);
  static const ddsi_sertype_ops told = [&] {
    ddsi_sertype_ops ops = *type->ops;
    ops.get_serialized_size = &sizeOf;
    return ops;
  }();
  type->ops = &told;
  ddsi_serdata_unref(data);
}

/// Returns the QoS of both readers and writers. `through`: see writerQos().
QosPtr commonQos(const Qos& qos, const SharedMemory& memory, bool through) {
  constexpr double kMaxBlocking = 0.1;
  QosPtr result(dds_create_qos());
  dds_qset_reliability(result.get(),
                       qos.reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT,
                       duration(kMaxBlocking));
  dds_qset_history(result.get(), DDS_HISTORY_KEEP_LAST, qos.depth);
  dds_qset_durability(result.get(),
                      qos.latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  if (qos.exclusive) dds_qset_ownership(result.get(), DDS_OWNERSHIP_EXCLUSIVE);
  if (memory.on() && !through && !qos.exclusive) {
    dds_qset_ignorelocal(result.get(), DDS_IGNORELOCAL_PARTICIPANT);
  }
  return result;
}

/// Returns the QoS of a reader, with the weakest liveliness, so that it matches every writer.
QosPtr readerQos(const Qos& qos, const SharedMemory& memory, ReadFrom from) {
  const bool of_before = from == ReadFrom::kKept;  // shared memory does not store earlier messages
  QosPtr result = commonQos(qos, memory, qos.shared_memory && !of_before);
  if (of_before) dds_qset_durability(result.get(), DDS_DURABILITY_TRANSIENT_LOCAL);
  if (from == ReadFrom::kNew) dds_qset_durability(result.get(), DDS_DURABILITY_VOLATILE);
  return result;
}

const TopicInfo& infoOf(const std::string& topic) {
  const TopicInfo* info = findTopic(topic);
  check(info != nullptr, "a topic stands in the list of common/wire/topics.h");
  return *info;
}

/// Throws StartupError if the entity uses shared memory but must not. With topics that have keys or
/// are latched, Cyclone 0.10.2 would lose messages or crash. Security forbids shared memory, which
/// has no access control.
void checkSharing(const Participant& participant, const Entity& entity, const std::string& topic,
                  const Qos& qos) {
  if (participant.identity() && dds_is_shared_memory_available(entity.handle())) {
    throw StartupError(ExitCode::kConfiguration,
                       "CYCLONEDDS_URI turns shared memory on, which is open to all, and "
                       "bus.security is set; take <SharedMemory> out of it");
  }
  if (qos.shared_memory || qos.exclusive || !dds_is_shared_memory_available(entity.handle())) {
    return;
  }
  throw StartupError(ExitCode::kConfiguration,
                     "CYCLONEDDS_URI turns shared memory on for all topics, which " + topic +
                         " does not bear; take <SharedMemory> out of it, or unset it and use "
                         "bus.shared_memory_mb");
}

/// The topic entity may be deleted at once, because readers and writers hold references to it.
Entity createTopic(const Participant& participant, const std::string& topic) {
  return created(dds_create_topic(participant.handle(), infoOf(topic).type,
                                  participant.wireName(topic).c_str(), nullptr, nullptr),
                 "the topic " + topic);
}

std::shared_ptr<const Entity> createReader(const Participant& participant, const std::string& topic,
                                           ReadFrom from) {
  const Entity entity = createTopic(participant, topic);
  const Qos& row = infoOf(topic).qos;
  const QosPtr qos = readerQos(row, participant.sharedMemory(), from);
  Entity reader =
      created(dds_create_reader(participant.handle(), entity.handle(), qos.get(), nullptr),
              "a reader of " + topic);
  checkSharing(participant, reader, topic, row);
  return participant.keep(std::move(reader));
}

std::shared_ptr<const Entity> createWriter(const Participant& participant, const std::string& topic,
                                           const WriterOptions& options,
                                           bool through_shared_memory) {
  const Entity entity = createTopic(participant, topic);
  const Qos& row = infoOf(topic).qos;
  const QosPtr qos = writerQos(row, options, participant.sharedMemory(), through_shared_memory);
  if (participant.sharedMemory().on() && through_shared_memory) {
    tellSizesOfFrames(participant.handle(), entity.handle());
  }
  Entity writer =
      created(dds_create_writer(participant.handle(), entity.handle(), qos.get(), nullptr),
              "a writer of " + topic);
  checkSharing(participant, writer, topic, row);
  return participant.keep(std::move(writer));
}

std::string errorWord(dds_return_t code) {
  switch (code) {
    case DDS_RETCODE_TIMEOUT:
      return "timeout";
    case DDS_RETCODE_OUT_OF_RESOURCES:
      return "out_of_resources";
    default:
      return "error_" + std::to_string(-code);
  }
}

}  // namespace

QosPtr writerQos(const Qos& qos, const WriterOptions& options, const SharedMemory& memory,
                 bool through) {
  QosPtr result = commonQos(qos, memory, through);
  dds_qset_writer_data_lifecycle(result.get(), false);  // instances outlive their writer
  const bool kept = qos.kept && !(memory.on() && through);
  if (kept) dds_qset_durability(result.get(), DDS_DURABILITY_TRANSIENT_LOCAL);
  if (qos.latched || kept) {
    const int late = kept ? 1 : qos.late > 0 ? qos.late : qos.depth;
    dds_qset_durability_service(result.get(), 0, DDS_HISTORY_KEEP_LAST, late, DDS_LENGTH_UNLIMITED,
                                DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  }
  const double lease = options.lease_s > 0 ? options.lease_s : qos.lease_s;
  if (qos.exclusive) {
    dds_qset_ownership_strength(result.get(), options.strength);
    dds_qset_liveliness(result.get(), DDS_LIVELINESS_MANUAL_BY_TOPIC, duration(lease));
  } else if (lease > 0) {
    dds_qset_liveliness(result.get(), DDS_LIVELINESS_AUTOMATIC, duration(lease));
  }
  return result;
}

Entity created(dds_entity_t handle, const std::string& what) {
  if (handle == DDS_RETCODE_NOT_ALLOWED_BY_SECURITY) {
    throw StartupError(ExitCode::kConfiguration,
                       "the identity of this process may not make " + what +
                           "; bus.identity names it, and `perdure security` says what each role "
                           "may do");
  }
  if (handle < 0) {
    throw StartupError(ExitCode::kUnavailable,
                       "DDS cannot create " + what + ": " + dds_strretcode(-handle));
  }
  return Entity(handle);
}

Endpoint::Endpoint(std::string topic, std::shared_ptr<const Entity> entity)
    : topic_(std::move(topic)),
      count_prefix_(topic_),
      entity_(std::move(entity)),
      handle_(entity_->handle()) {
  std::replace(count_prefix_.begin(), count_prefix_.end(), '/', '_');
}

void Endpoint::replace(std::shared_ptr<const Entity> entity) {
  handle_ = entity->handle();
  entity_ = std::move(entity);
}

void Endpoint::count(const char* what, const Reason& reason) {
  const std::string name = count_prefix_ + "_" + what + "_" + reason.code;
  const std::lock_guard lock(mutex_);
  refusals_.add(name);
  first_details_.emplace(name, reason.detail);
}

std::map<std::string, std::string> Endpoint::firstDetails() const {
  const std::lock_guard lock(mutex_);
  return first_details_;
}

void Endpoint::add(ReasonCounts& counts, const char* what, std::uint64_t n) const {
  if (n > 0) counts.add(count_prefix_ + "_" + what, n);
}

void Endpoint::addRefusals(ReasonCounts& counts) const {
  const std::lock_guard lock(mutex_);
  counts.add(refusals_);
}

Result<void> Endpoint::outcome(const char* what, std::int32_t code) {
  if (code == DDS_RETCODE_OK) return {};
  const Reason reason{errorWord(code), std::string("DDS: ") + dds_strretcode(-code)};
  count(what, reason);
  return tl::unexpected(reason);
}

std::size_t AnyReader::matched() const {
  dds_subscription_matched_status_t status{};
  dds_get_subscription_matched_status(handle(), &status);
  return status.current_count;
}

void AnyReader::report(ReasonCounts& counts) const {
  addRefusals(counts);
  dds_requested_incompatible_qos_status_t incompatible{};
  dds_get_requested_incompatible_qos_status(handle(), &incompatible);
  add(counts, "incompatible_qos", incompatible.total_count);
  dds_sample_lost_status_t lost{};
  dds_get_sample_lost_status(handle(), &lost);
  add(counts, "sample_lost", lost.total_count);
}

std::size_t AnyWriter::matched() const {
  dds_publication_matched_status_t status{};
  dds_get_publication_matched_status(handle(), &status);
  return status.current_count;
}

void AnyWriter::report(ReasonCounts& counts) const {
  addRefusals(counts);
  dds_offered_incompatible_qos_status_t incompatible{};
  dds_get_offered_incompatible_qos_status(handle(), &incompatible);
  add(counts, "incompatible_qos", incompatible.total_count);
}

RawReader::RawReader(const Participant& participant, const std::string& topic, ReadFrom from)
    : AnyReader(topic, createReader(participant, topic, from)) {}

std::size_t RawReader::silent() const {
  dds_liveliness_changed_status_t liveliness{};
  dds_get_liveliness_changed_status(handle(), &liveliness);
  return liveliness.not_alive_count;
}

std::optional<std::int32_t> RawReader::strongestBut(const RawWriter& own) const {
  constexpr std::size_t kMost = 64;
  std::array<dds_instance_handle_t, kMost> writers{};
  dds_instance_handle_t self = 0;
  dds_get_instance_handle(own.handle(), &self);
  const dds_return_t n = dds_get_matched_publications(handle(), writers.data(), kMost);
  std::optional<std::int32_t> strongest;
  for (std::size_t i = 0; n > 0 && i < std::min(static_cast<std::size_t>(n), kMost); ++i) {
    if (writers[i] == self) continue;
    const std::unique_ptr<dds_builtintopic_endpoint_t, decltype(&dds_builtintopic_free_endpoint)>
        data(dds_get_matched_publication_data(handle(), writers[i]),
             &dds_builtintopic_free_endpoint);
    std::int32_t strength = 0;
    if (!data || !dds_qget_ownership_strength(data->qos, &strength)) continue;
    strongest = std::max(strongest.value_or(strength), strength);
  }
  return strongest;
}

void RawReader::report(ReasonCounts& counts) const {
  AnyReader::report(counts);
  dds_sample_rejected_status_t rejected{};
  dds_get_sample_rejected_status(handle(), &rejected);
  add(counts, "sample_rejected", rejected.total_count);
  add(counts, "in_shared_memory", in_shared_memory_);
  add(counts, "writers_silent", silent());
}

bool RawReader::takeBatch(const std::function<void(const void*)>& on_value,
                          const std::function<void(const void*)>& on_gone) {
  std::array<void*, kBatch> samples{};
  std::array<dds_sample_info_t, kBatch> infos{};
  const dds_return_t n = dds_take(handle(), samples.data(), infos.data(), kBatch, kBatch);
  if (n <= 0) return false;
  struct Loan {
    dds_entity_t reader;
    void** samples;
    dds_return_t n;
    ~Loan() { dds_return_loan(reader, samples, n); }
  } const loan{handle(), samples.data(), n};
  for (std::size_t i = 0; i < static_cast<std::size_t>(n); ++i) {
    if (infos[i].valid_data) on_value(samples[i]);
    const bool last = !infos[i].valid_data || infos[i].sample_rank == 0;
    if (last && infos[i].instance_state == DDS_IST_NOT_ALIVE_DISPOSED) on_gone(samples[i]);
  }
  return static_cast<std::size_t>(n) == kBatch;
}

bool RawReader::takeBatchInPlace(const InPlace& on_value) {
  const auto samples = takeInPlace(entity(), kBatch);
  for (const RawSample& sample : samples) {
    in_shared_memory_ += sample.in_shared_memory;
    on_value(sample.cdr, sample.keeper);
  }
  return samples.size() == kBatch;
}

RawWriter::RawWriter(const Participant& participant, const std::string& topic,
                     const WriterOptions& options)
    : AnyWriter(topic, createWriter(participant, topic, options, infoOf(topic).qos.shared_memory)),
      participant_(participant),
      options_(options),
      strength_(options.strength),
      in_shared_memory_(dds_is_shared_memory_available(handle())) {}

void RawWriter::setStrength(std::int32_t strength) {
  const QosPtr qos(dds_create_qos());
  dds_qset_ownership_strength(qos.get(), strength);
  check(dds_set_qos(handle(), qos.get()) == DDS_RETCODE_OK,
        "the strength of a writer of an exclusive topic can be changed");
  strength_ = strength;
}

void RawWriter::assertLiveliness() { dds_assert_liveliness(handle()); }

std::uint64_t RawWriter::livelinessLost() const {
  dds_liveliness_lost_status_t status{};
  dds_get_liveliness_lost_status(handle(), &status);
  return status.total_count;
}

bool RawWriter::waitForAcknowledgement(double seconds) {
  return dds_wait_for_acks(handle(), duration(seconds)) == DDS_RETCODE_OK;
}

void RawWriter::report(ReasonCounts& counts) const {
  AnyWriter::report(counts);
  add(counts, "liveliness_lost", livelinessLost());
}

/// Replaces the writer by one that sends over the network interface, and waits for its readers for
/// at most half a second.
void RawWriter::leaveSharedMemory(const Reason& reason) {
  constexpr dds_duration_t kPatience = DDS_MSECS(500), kPause = DDS_MSECS(5);
  const std::size_t readers = matched();
  replace(createWriter(participant_, topic(), options_, false));
  in_shared_memory_ = false;
  count("left_shared_memory", reason);
  for (dds_duration_t waited = 0; matched() < readers && waited < kPatience; waited += kPause) {
    dds_sleepfor(kPause);
  }
}

/// Waits before the first message with readers. RouDi connects a writer to its readers up to 100 ms
/// after DDS has matched them; earlier messages are lost.
void RawWriter::awaitJoin() {
  constexpr dds_duration_t kJoin = DDS_MSECS(200);
  if (!in_shared_memory_ || joined_ || matched() == 0) return;
  dds_sleepfor(kJoin);
  joined_ = true;
}

Result<void> RawWriter::writeWire(const void* wire, std::size_t bytes) {
  // iceoryx aborts the process if no chunk is large enough.
  if (in_shared_memory_ && bytes > participant_.sharedMemory().most_bytes) {
    leaveSharedMemory({"too_large", "an image of " + std::to_string(bytes) +
                                        " bytes; raise bus.shared_memory_mb, and the chunks in "
                                        "RouDi's configuration"});
  }
  awaitJoin();
  dds_return_t code = dds_write(handle(), wire);
  if (code == DDS_RETCODE_OUT_OF_RESOURCES && in_shared_memory_) {
    leaveSharedMemory({"used_up", "no chunk of " + std::to_string(bytes) +
                                      " bytes is free; give RouDi more of them, or start it and "
                                      "the services again where processes were killed often"});
    code = dds_write(handle(), wire);
  }
  return outcome("write", code);
}

void RawWriter::unregisterWire(const void* wire) { dds_unregister_instance(handle(), wire); }

Result<void> RawWriter::disposeWire(const void* wire) {
  const dds_return_t code = dds_dispose(handle(), wire);
  dds_unregister_instance(handle(), wire);  // hides the disposal from late joiners
  return outcome("dispose", code);
}

}  // namespace perdure::bus
