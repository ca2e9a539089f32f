// A reader that exists only while it is wanted, so that no unused data is sent to this process.
#pragma once

#include <functional>
#include <memory>
#include <utility>

#include "common/service/service.h"

namespace perdure::service {

class OnDemand {
 public:
  using Wanted = std::function<bool()>;
  /// Creates a reader and adds it to the context's loop.
  using Open = std::function<std::shared_ptr<bus::RawReader>()>;

  OnDemand(Context& context, Wanted wanted, Open open)
      : context_(context), wanted_(std::move(wanted)), open_(std::move(open)) {}
  /// Constructor for a reader of a topic; its counts are published in Health.
  template <class T>
  OnDemand(Context& context, bus::Topic<T> topic, Wanted wanted,
           std::type_identity_t<Sink<T>> handler, std::type_identity_t<Sink<T>> on_gone = {})
      : OnDemand(context, std::move(wanted), [&context, topic, handler, on_gone] {
          auto reader = std::make_shared<bus::Reader<T>>(context.participant(), topic);
          context.loop().on(*reader, handler, on_gone);
          return reader;
        }) {
    context.countReasons([this](ReasonCounts& counts) {
      for (const auto& [reason, n] : before_.all()) counts.add(reason, n);
      if (reader_) reader_->report(counts);
    });
  }
  OnDemand(const OnDemand&) = delete;
  OnDemand& operator=(const OnDemand&) = delete;

  /// Opens the reader if it is wanted, and closes it if not. Must not be called from a handler of
  /// messages.
  void follow() {
    if (wanted_() == (reader_ != nullptr)) return;
    if (!reader_) {
      reader_ = open_();
      return;
    }
    reader_->report(before_);
    context_.loop().off(*reader_);
    reader_.reset();
  }

 private:
  Context& context_;
  const Wanted wanted_;
  const Open open_;
  std::shared_ptr<bus::RawReader> reader_;
  ReasonCounts before_;  ///< counts of the closed readers
};

}  // namespace perdure::service
