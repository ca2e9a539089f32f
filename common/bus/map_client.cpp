#include "common/bus/map_client.h"

#include <chrono>

namespace perdure::bus {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

MapClient::MapClient(const Participant& participant)
    : participant_(participant),
      questions_(participant, kTopic<MapQuery>),
      answers_(participant, kTopic<MapReply>),
      loop_(participant) {
  loop_.on(answers_, [this](const MapReply& reply) {
    if (reply.client == client_ && reply.request == request_) reply_ = reply;
  });
}

Result<MapReply> MapClient::ask(const MapQuery& query, double patience_s) {
  return ask(questions_, query, patience_s);
}

Result<MapReply> MapClient::correct(const Correction& correction, double patience_s) {
  Writer<MapCorrection> corrections(participant_, kTopic<MapCorrection>);
  return ask(corrections, {0, 0, correction}, patience_s);
}

template <class Question>
Result<MapReply> MapClient::ask(Writer<Question>& questions, Question question, double patience_s) {
  constexpr auto kResend = 500ms;
  question.client = client_;
  question.request = ++request_;
  reply_.reset();
  const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                      std::chrono::duration<double>(patience_s));
  Clock::time_point next_send{};
  bool matched = false;
  while (!reply_) {
    const auto now = Clock::now();
    if (now >= end) return fail(matched ? "no_answer" : "no_map_store");
    matched = questions.matched() > 0 && answers_.matched() > 0;
    if (matched && now >= next_send) {
      (void)questions.write(question);
      next_send = now + kResend;
    }
    loop_.runOnce(20ms);
  }
  return *std::move(reply_);
}

}  // namespace perdure::bus
