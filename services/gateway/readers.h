// Readers that exist only while clients need them, so that no unused data is sent to this process.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "common/service/service.h"
#include "services/gateway/core/channels.h"

namespace perdure::gateway {

class OnDemand {
 public:
  OnDemand(service::Context& context, Channels channels)
      : context_(context), channels_(std::move(channels)) {}
  virtual ~OnDemand() = default;
  OnDemand(const OnDemand&) = delete;
  OnDemand& operator=(const OnDemand&) = delete;
  /// Must not be called from a handler of messages.
  void follow(const Channels& wanted) {
    tidy();
    bool now = false;
    for (const std::uint32_t channel : channels_) now = now || wanted.contains(channel);
    if (now == open_) return;
    open_ = now;
    if (now) {
      open();
    } else {
      close();
    }
  }

 protected:
  virtual void open() = 0;
  virtual void close() = 0;
  virtual void tidy() {}
  service::Context& context_;

 private:
  const Channels channels_;
  bool open_ = false;
};

template <class T>
class ReaderOnDemand : public OnDemand {
 public:
  ReaderOnDemand(service::Context& context, bus::Topic<T> topic, Channels channels, Sink<T> handler,
                 Sink<T> on_gone = {})
      : OnDemand(context, std::move(channels)),
        topic_(std::move(topic)),
        handler_(std::move(handler)),
        on_gone_(std::move(on_gone)) {
    context.countReasons([this](ReasonCounts& counts) {
      for (const auto& [reason, n] : before_.all()) counts.add(reason, n);
      if (reader_) reader_->report(counts);
    });
  }

 private:
  void open() override {
    reader_ = std::make_unique<bus::Reader<T>>(context_.participant(), topic_);
    context_.loop().on(*reader_, handler_, on_gone_);
  }
  void close() override {
    reader_->report(before_);
    context_.loop().off(*reader_);
    reader_.reset();
  }

  const bus::Topic<T> topic_;
  const Sink<T> handler_, on_gone_;
  std::unique_ptr<bus::Reader<T>> reader_;
  ReasonCounts before_;
};

/// The same for the unparsed bytes of a topic.
class BytesOnDemand : public OnDemand {
 public:
  using Handler = std::function<void(const bus::CdrMessage&)>;
  BytesOnDemand(service::Context& context, std::string topic, Channels channels, Handler handler)
      : OnDemand(context, std::move(channels)),
        topic_(std::move(topic)),
        handler_(std::move(handler)) {}

 private:
  void open() override {
    reader_ = std::make_unique<bus::CdrReader>(context_.participant(), topic_);
    context_.loop().on(*reader_, handler_);
  }
  void close() override {
    context_.loop().off(*reader_);
    reader_.reset();
  }

  const std::string topic_;
  const Handler handler_;
  std::unique_ptr<bus::CdrReader> reader_;
};

/// Delivers the newest earlier message, which writers store (bus::Qos::kept), to new viewers. The
/// reader is closed after the first message. From writers without stored messages, it receives
/// none.
template <class T>
class NewestOfBefore : public OnDemand {
 public:
  NewestOfBefore(service::Context& context, bus::Topic<T> topic, Channels channels, Sink<T> handler)
      : OnDemand(context, std::move(channels)),
        topic_(std::move(topic)),
        handler_(std::move(handler)) {}

 private:
  void open() override {
    reader_ =
        std::make_unique<bus::Reader<T>>(context_.participant(), topic_, bus::ReadFrom::kKept);
    context_.loop().on(*reader_, [this](const T& message) {
      if (!std::exchange(heard_, true)) handler_(message);
      context_.loop().wake();  // a reader must not be closed while messages are delivered
    });
  }
  void tidy() override {
    if (heard_) close();
  }
  void close() override {
    heard_ = false;
    if (!reader_) return;
    context_.loop().off(*reader_);
    reader_.reset();
  }

  const bus::Topic<T> topic_;
  const Sink<T> handler_;
  std::unique_ptr<bus::Reader<T>> reader_;
  bool heard_ = false;
};

}  // namespace perdure::gateway
