#include "services/map_store/fleet/replicator.h"

#include <fmt/format.h>

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "services/map_store/fleet/pusher.h"
#include "services/map_store/fleet/server_schema.h"
#include "services/map_store/fleet/server_url.h"

namespace perdure::map_store::fleet {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::int64_t kFewestRows = 50;

constexpr char kNoPostgis[] =
    "The server has no PostGIS, so its maps have no geometry; install postgresql-15-postgis-3 "
    "there and let its administrator run CREATE EXTENSION postgis in the database.";

std::string fixOf(const std::string& code) {
  if (code == "server_unreachable") {
    return "see that the server runs and that store.url leads to it";
  }
  if (code == "server_login") {
    return "correct user and database in store.url, and the password in its passfile";
  }
  if (code == "server_rights") {
    return "let the server's administrator GRANT CREATE on the database to the user of store.url, "
           "or, where schema perdure is there, usage of it and all of its tables";
  }
  if (code == "server_schema") {
    return "use the same version of Perdure for all, and a database made with ENCODING 'UTF8'";
  }
  if (code == "server_full") return "free space on the server";
  if (code == "server_busy") return "see what else keeps the server busy";
  if (code == "server_overtaken") {
    return "give each vehicle a store.vehicle and a file of its own, and end the other process";
  }
  if (code == "server_refused") return "see the server's log";
  return "look at the disk of store.path";
}

/// Whether a retry with fewer rows may succeed.
bool isSlowness(const std::string& code) {
  return code == "server_busy" || code == "server_unreachable";
}

}  // namespace

struct Replicator::Work {
  Work(const Parameters& parameters, std::string file, const Pace& given)
      : url(parameters.url),
        pace(given),
        pusher(std::move(file), vehicleOf(parameters), parameters.earth_anchor),
        most_rows(given.most_rows),
        thread([this] { run(); }) {}
  ~Work() {
    stop.raise();
    {
      const std::lock_guard lock(mutex);
      stopping = true;
    }
    woken.notify_all();
    thread.join();
  }

  void run();
  Result<void> connect();
  Result<void> sendAll();
  void fail(const Reason& reason);
  void succeed(const Portion& portion, std::uint64_t wakes_before);
  /// Returns false if the thread must end.
  bool rest(std::optional<Clock::duration> time);

  const std::string url;
  const Pace pace;
  Pusher pusher;
  std::int64_t most_rows;
  Stop stop;
  std::optional<Link> link;
  std::chrono::milliseconds retry{0};
  std::optional<Clock::time_point> failing_since;

  mutable std::mutex mutex;
  std::condition_variable woken, advanced;
  bool stopping = false;
  std::uint64_t wakes = 1, served = 0;  ///< number of wakes, and of those whose changes are all
                                        ///< sent
  /// Times of the first unserved wake before the present portion, and of the first wake since.
  std::optional<Clock::time_point> serving_since, woken_at;
  Progress progress;

  std::thread thread;  // last member: it uses the others
};

void Replicator::Work::run() {
  for (;;) {
    auto done = link ? Result<void>() : connect();
    if (done) done = sendAll();
    if (!done && done.error().code == "stopped") return;
    if (!done) fail(done.error());
    if (!rest(done ? std::nullopt : std::optional<Clock::duration>(retry))) return;
  }
}

Result<void> Replicator::Work::connect() {
  auto opened = Link::open(url, {pace.connect, pace.answer}, stop);
  if (!opened) return tl::unexpected<Reason>(opened.error());
  const auto geometry = prepareServer(*opened);
  if (!geometry) return tl::unexpected<Reason>(geometry.error());
  const auto attached = pusher.attach(*opened);
  if (!attached) return attached;
  link.emplace(std::move(*opened));
  const std::lock_guard lock(mutex);
  progress.sent = pusher.sent();
  progress.notice = *geometry ? "" : kNoPostgis;
  if (!*geometry) progress.reasons.add("postgis_missing");
  return {};
}

Result<void> Replicator::Work::sendAll() {
  for (;;) {
    std::uint64_t before = 0;
    {
      const std::lock_guard lock(mutex);
      if (stopping) return perdure::fail("stopped");
      before = wakes;
      if (!serving_since) serving_since = woken_at;
      woken_at.reset();
    }
    const auto more = pusher.hasMore();
    if (!more) return tl::unexpected<Reason>(more.error());
    if (!*more) {
      succeed({0, pusher.sent(), true}, before);
      return {};
    }
    const auto portion = pusher.push(*link, most_rows);
    if (!portion) return tl::unexpected<Reason>(portion.error());
    most_rows = std::min(pace.most_rows, 2 * most_rows);
    succeed(*portion, before);
  }
}

void Replicator::Work::succeed(const Portion& portion, std::uint64_t wakes_before) {
  retry = std::chrono::milliseconds(0);
  failing_since.reset();
  {
    const std::lock_guard lock(mutex);
    progress.sent = portion.sent;
    progress.rows += portion.rows;
    progress.portions += portion.rows > 0 ? 1 : 0;
    progress.failing.clear();
    progress.trouble.clear();
    if (portion.whole) {
      if (portion.rows > 0 && serving_since) {
        progress.latency_s = std::chrono::duration<double>(Clock::now() - *serving_since).count();
      }
      serving_since.reset();
      served = wakes_before;
    }
    progress.whole = served == wakes;
  }
  advanced.notify_all();
}

void Replicator::Work::fail(const Reason& reason) {
  link.reset();
  if (isSlowness(reason.code)) most_rows = std::max(kFewestRows, most_rows / 2);
  retry = std::clamp(2 * retry, pace.first_retry, pace.longest_retry);
  failing_since = failing_since.value_or(Clock::now());
  const auto since =
      std::chrono::duration_cast<std::chrono::seconds>(Clock::now() - *failing_since);
  const std::lock_guard lock(mutex);
  progress.reasons.add(reason);
  progress.whole = false;
  progress.failing = reason.code;
  progress.trouble = fmt::format(
      "The map has not been sent to the fleet's server for {} s ({}: {}). What changes is kept in "
      "store.path and sent when that is over; {}.",
      since.count(), reason.code, reason.detail, fixOf(reason.code));
}

bool Replicator::Work::rest(std::optional<Clock::duration> time) {
  std::unique_lock lock(mutex);
  const auto wanted = [&] { return stopping || (!time && wakes != served); };
  if (time) {
    woken.wait_for(lock, *time, wanted);
  } else {
    woken.wait(lock, wanted);
  }
  return !stopping;
}

Replicator::Replicator(const Parameters& parameters, std::string file, const Pace& pace) {
  check(parameters);
  work_ = std::make_unique<Work>(parameters, std::move(file), pace);
}

Replicator::~Replicator() = default;

void Replicator::wake() {
  {
    const std::lock_guard lock(work_->mutex);
    ++work_->wakes;
    work_->woken_at = work_->woken_at.value_or(Clock::now());
    work_->progress.whole = false;
  }
  work_->woken.notify_all();
}

Progress Replicator::progress() const {
  const std::lock_guard lock(work_->mutex);
  return work_->progress;
}

bool Replicator::finish(std::chrono::milliseconds patience) {
  std::unique_lock lock(work_->mutex);
  return work_->advanced.wait_for(lock, patience, [&] { return work_->progress.whole; });
}

}  // namespace perdure::map_store::fleet
