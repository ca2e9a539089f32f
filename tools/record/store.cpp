#include "tools/record/store.h"

namespace perdure::tools {
namespace {

constexpr std::size_t kWaiting = 64;  // chunks: 16 s, or 128 MB of images

}  // namespace

Store::Store(const StoreOptions& options, SegmentFolder& folder)
    : options_(options),
      folder_(folder),
      writer_(folder,
              options.last_s > 0 ? options.last_s + options.after_s + 60.0 : options.segment_s,
              options.last_s > 0 ? "-fault" : ""),
      queue_(kWaiting, Overflow::kDropOldest) {
  if (options.last_s > 0) black_box_.emplace(options.last_s, options.memory);
  thread_ = std::thread([this] { run(); });
}

Store::~Store() { finish(); }

void Store::give(Job job) {
  if (job.fault) fault_ = true;  // not only in the job, because the job may be dropped
  (void)queue_.push(std::move(job));
}

void Store::finish() {
  queue_.close();
  if (thread_.joinable()) thread_.join();
}

StoreReport Store::report() const {
  const std::lock_guard lock(mutex_);
  StoreReport report = report_;
  report.overrun = queue_.dropped();
  return report;
}

void Store::run() {
  while (auto job = queue_.pop()) {
    ++now_.chunks;
    handle(*std::move(job));
    publish();
  }
  writer_.finish();
  publish();
}

void Store::handle(Job job) {
  PackedChunk packed{{}, std::move(job.catalogue), std::move(job.latched), job.steady_ns};
  if (!job.draft.empty()) packed.chunk = replay::mcap::pack(job.draft);
  if (black_box_) return writeBlackBox(std::move(packed), fault_.exchange(false));
  if (packed.chunk.messages > 0) write(packed);
}

void Store::write(const PackedChunk& packed) {
  if (writer_.add(packed)) {
    now_.messages += packed.chunk.messages;
  } else {
    now_.lost += packed.chunk.messages;
    now_.lost_to = writer_.problem();
  }
}

void Store::writeBlackBox(PackedChunk packed, bool fault) {
  const std::int64_t at = packed.steady_ns;
  if (packed.chunk.messages > 0) black_box_->add(std::move(packed));
  if (fault) {
    if (!dump_until_ns_) ++now_.dumps;
    dump_until_ns_ = at + static_cast<std::int64_t>(options_.after_s * 1e9);
  }
  if (!dump_until_ns_) return;
  for (const PackedChunk& chunk : black_box_->take()) write(chunk);
  if (at < *dump_until_ns_) return;
  dump_until_ns_.reset();
  writer_.finish();
}

void Store::publish() {
  now_.bytes = writer_.bytes();
  now_.files = writer_.files();
  now_.problem = writer_.problem();
  now_.disk_full = writer_.diskFull();
  now_.removed = folder_.removed();
  now_.folder_bytes = folder_.bytes();
  if (black_box_) now_.cut_short = black_box_->cutShort();
  const std::lock_guard lock(mutex_);
  report_ = now_;
}

}  // namespace perdure::tools
