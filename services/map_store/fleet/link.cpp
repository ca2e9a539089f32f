#include "services/map_store/fleet/link.h"

#include <libpq-fe.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>

#include "common/base/algorithms/utf8.h"

namespace perdure::map_store::fleet {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kBinary = 1;
/// SQLSTATE that Perdure's functions on the server raise for "server_overtaken".
constexpr std::string_view kOvertaken = "PE001";

std::string inBigEndian(std::uint64_t value) {
  std::string bytes(8, '\0');
  for (int i = 7; i >= 0; --i, value >>= 8)
    bytes[static_cast<std::size_t>(i)] = static_cast<char>(value);
  return bytes;
}

std::uint64_t fromBigEndian(const char* bytes) {
  std::uint64_t value = 0;
  for (int i = 0; i < 8; ++i) value = value << 8 | static_cast<std::uint8_t>(bytes[i]);
  return value;
}

std::string onlyUtf8(std::string_view text) {
  std::string clean;
  while (!text.empty()) {
    const std::size_t length = text.front() == '\0' ? 0 : lengthOfCharacter(text);
    clean += length == 0 ? "?" : std::string(text.substr(0, length));
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return clean;
}

/// Returns the first line of libpq's message. It contains no password, because checkUrl() refuses
/// URLs with one.
std::string firstLine(const char* message) {
  const std::string text = message == nullptr ? "" : message;
  return text.substr(0, text.find('\n'));
}

/// Returns the SQLSTATE in a verbose message, for example "FATAL:  28P01: password …".
std::string stateIn(const std::string& message) {
  for (std::size_t at = message.find(":  "); at != std::string::npos;
       at = message.find(":  ", at + 1)) {
    const std::string state = message.substr(at + 3, 5);
    const bool alike = state.size() == 5 && message.compare(at + 8, 1, ":") == 0 &&
                       std::all_of(state.begin(), state.end(), [](unsigned char c) {
                         return std::isdigit(c) || std::isupper(c);
                       });
    if (alike) return state;
  }
  return {};
}

std::string codeOf(std::string_view state) {
  const std::string_view kind = state.substr(0, 2);
  if (state == kOvertaken) return "server_overtaken";
  if (kind == "28" || state == "3D000") return "server_login";
  if (state == "42501") return "server_rights";
  if (state == "53300" || kind == "08" || state.starts_with("57P0")) return "server_unreachable";
  if (kind == "53" || kind == "54") return "server_full";
  if (kind == "40" || state == "55P03" || state == "57014") return "server_busy";
  return "server_refused";
}

Reason reasonOf(const PGresult* result) {
  const char* state = PQresultErrorField(result, PG_DIAG_SQLSTATE);
  const char* message = PQresultErrorField(result, PG_DIAG_MESSAGE_PRIMARY);
  if (state == nullptr) return {"server_unreachable", firstLine(PQresultErrorMessage(result))};
  return {codeOf(state), firstLine(message)};
}

bool isGood(const PGresult* result) {
  const auto status = PQresultStatus(result);
  return status == PGRES_COMMAND_OK || status == PGRES_TUPLES_OK || status == PGRES_PIPELINE_SYNC;
}

void ignoreNotice(void*, const PGresult*) {}

struct Pointers {
  std::vector<const char*> values;
  std::vector<int> lengths, formats;
};

Pointers pointersTo(const std::vector<std::optional<std::string>>& bytes) {
  Pointers to;
  for (const auto& value : bytes) {
    to.values.push_back(value ? value->data() : nullptr);
    to.lengths.push_back(value ? static_cast<int>(value->size()) : 0);
    to.formats.push_back(kBinary);
  }
  return to;
}

}  // namespace

Values& Values::put(std::int64_t value) {
  bytes_.emplace_back(inBigEndian(static_cast<std::uint64_t>(value)));
  return *this;
}

Values& Values::put(double value) {
  bytes_.emplace_back(inBigEndian(std::bit_cast<std::uint64_t>(value)));
  return *this;
}

Values& Values::put(std::string_view value) {
  bytes_.emplace_back(onlyUtf8(value));
  return *this;
}

Values& Values::put(std::span<const std::uint8_t> value) {
  bytes_.emplace_back(std::in_place, value.begin(), value.end());
  return *this;
}

Values& Values::null() {
  bytes_.emplace_back();
  return *this;
}

void Answer::Clear::operator()(pg_result* result) const { PQclear(result); }
int Answer::rows() const { return PQntuples(result_.get()); }
bool Answer::isNull(int row, int column) const {
  return PQgetisnull(result_.get(), row, column) != 0;
}

std::int64_t Answer::integer(int row, int column) const {
  const bool there = PQgetlength(result_.get(), row, column) == 8;
  return there ? static_cast<std::int64_t>(fromBigEndian(PQgetvalue(result_.get(), row, column)))
               : 0;
}

double Answer::real(int row, int column) const {
  return std::bit_cast<double>(static_cast<std::uint64_t>(integer(row, column)));
}

bool Answer::boolean(int row, int column) const {
  const auto bytes = blob(row, column);
  return !bytes.empty() && bytes[0] != 0;
}

std::string Answer::text(int row, int column) const {
  const auto bytes = blob(row, column);
  return {bytes.begin(), bytes.end()};
}

std::span<const std::uint8_t> Answer::blob(int row, int column) const {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(PQgetvalue(result_.get(), row, column));
  return {bytes, static_cast<std::size_t>(PQgetlength(result_.get(), row, column))};
}

void Link::Close::operator()(pg_conn* connection) const { PQfinish(connection); }

Result<Link> Link::open(const std::string& url, const Patience& patience, const Stop& stop) {
  const std::string unsent = std::to_string(patience.answer.count());
  const std::array<const char*, 7> names = {"dbname",
                                            "fallback_application_name",
                                            "client_encoding",
                                            "tcp_user_timeout",
                                            "keepalives_idle",
                                            "keepalives_interval",
                                            nullptr};
  const std::array<const char*, 7> values = {url.c_str(), "perdure", "UTF8", unsent.c_str(),
                                             "10",        "5",       nullptr};
  constexpr int kExpandUrl = 1;
  Link link(PQconnectStartParams(names.data(), values.data(), kExpandUrl), patience, stop);
  if (!link.connection_) return fail("server_unreachable", "there is no memory for a connection");
  PQsetNoticeReceiver(link.connection_.get(), ignoreNotice, nullptr);
  PQsetErrorVerbosity(link.connection_.get(), PQERRORS_VERBOSE);
  auto done = link.finishConnecting();
  if (done) done = link.setUp();
  if (!done) return tl::unexpected<Reason>(done.error());
  return link;
}

Result<void> Link::finishConnecting() {
  const auto until = Clock::now() + patience_.connect;
  PostgresPollingStatusType polling = PGRES_POLLING_WRITING;
  while (PQstatus(connection_.get()) != CONNECTION_BAD && polling != PGRES_POLLING_OK) {
    const auto waited = wait(polling == PGRES_POLLING_READING ? POLLIN : POLLOUT, until);
    if (!waited) return waited;
    polling = PQconnectPoll(connection_.get());
    if (polling == PGRES_POLLING_FAILED) break;
  }
  if (polling == PGRES_POLLING_OK) return {};
  const std::string message = PQerrorMessage(connection_.get());
  const std::string state = stateIn(message);
  const bool wants_password = PQconnectionNeedsPassword(connection_.get()) != 0;
  std::string code = state.empty() ? "server_unreachable" : codeOf(state);
  if (wants_password) code = "server_login";
  return fail(code, firstLine(message.c_str()));
}

/// Configures the session: an acknowledged commit is on the server's disk, and a lost link ends a
/// transaction.
Result<void> Link::setUp() {
  if (PQsetnonblocking(connection_.get(), 1) != 0) return tl::unexpected<Reason>(lost());
  const std::string milliseconds = std::to_string(patience_.answer.count());
  return run("SET statement_timeout = " + milliseconds + "; SET lock_timeout = " + milliseconds +
             "; SET idle_in_transaction_session_timeout = " + milliseconds +
             "; SELECT set_config('synchronous_commit', 'on', false) "
             "WHERE current_setting('synchronous_commit') = 'off'");
}

Reason Link::lost() const {
  const std::string line = firstLine(PQerrorMessage(connection_.get()));
  return {"server_unreachable", line.empty() ? "the connection was lost" : line};
}

Result<void> Link::wait(short events, Clock::time_point until) const {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now());
  std::array<pollfd, 2> files = {pollfd{PQsocket(connection_.get()), events, 0},
                                 pollfd{stop_->file(), POLLIN, 0}};
  const int ready =
      poll(files.data(), files.size(), static_cast<int>(std::max<std::int64_t>(left.count(), 0)));
  if (files[1].revents != 0 && ready > 0) return fail("stopped");
  if (ready == 0) return fail("server_unreachable", "the server does not answer");
  return {};  // poll() was interrupted; the caller waits again
}

/// Returns the next result, or null at the end of a statement's results.
Result<pg_result*> Link::next() {
  auto until = Clock::now() + patience_.answer;
  for (;;) {
    const int unsent = PQflush(connection_.get());
    if (unsent < 0) return tl::unexpected<Reason>(lost());
    if (PQisBusy(connection_.get()) == 0) return PQgetResult(connection_.get());
    const auto waited = wait(static_cast<short>(unsent > 0 ? POLLIN | POLLOUT : POLLIN), until);
    if (!waited) return tl::unexpected<Reason>(waited.error());
    if (PQconsumeInput(connection_.get()) == 0) return tl::unexpected<Reason>(lost());
    until = Clock::now() + patience_.answer;
  }
}

/// Waits for all results and returns the last one.
Result<Answer> Link::last() {
  Answer answer(nullptr);
  std::optional<Reason> wrong;
  for (;;) {
    const auto result = next();
    if (!result) return tl::unexpected<Reason>(result.error());
    if (*result == nullptr) break;
    answer = Answer(*result);
    if (!isGood(*result) && !wrong) wrong = reasonOf(*result);
  }
  if (PQstatus(connection_.get()) == CONNECTION_BAD) return tl::unexpected<Reason>(lost());
  if (wrong) return tl::unexpected<Reason>(*wrong);
  return answer;
}

Result<Answer> Link::ask(const std::string& sql, const Values& values) {
  const Pointers to = pointersTo(values.bytes_);
  const int sent =
      PQsendQueryParams(connection_.get(), sql.c_str(), static_cast<int>(to.values.size()), nullptr,
                        to.values.data(), to.lengths.data(), to.formats.data(), kBinary);
  if (sent == 0) return tl::unexpected<Reason>(lost());
  return last();
}

Result<void> Link::run(const std::string& sql) {
  if (PQsendQuery(connection_.get(), sql.c_str()) == 0) return tl::unexpected<Reason>(lost());
  const auto answer = last();
  if (!answer) return tl::unexpected<Reason>(answer.error());
  return {};
}

Result<void> Link::prepare(const std::string& name, const std::string& sql) {
  if (PQsendPrepare(connection_.get(), name.c_str(), sql.c_str(), 0, nullptr) == 0) {
    return tl::unexpected<Reason>(lost());
  }
  const auto answer = last();
  if (!answer) return tl::unexpected<Reason>(answer.error());
  return {};
}

void Link::beginBatch(bool as_transaction) {
  unsent_ = PQenterPipelineMode(connection_.get()) == 0;
  as_transaction_ = as_transaction;
  if (as_transaction) queueCommand("BEGIN");
}

void Link::queueCommand(const char* sql) {
  unsent_ = unsent_ || PQsendQueryParams(connection_.get(), sql, 0, nullptr, nullptr, nullptr,
                                         nullptr, kBinary) == 0;
}

void Link::queue(const std::string& prepared, const Values& values) {
  const Pointers to = pointersTo(values.bytes_);
  unsent_ = unsent_ || PQsendQueryPrepared(connection_.get(), prepared.c_str(),
                                           static_cast<int>(to.values.size()), to.values.data(),
                                           to.lengths.data(), to.formats.data(), kBinary) == 0;
}

Result<void> Link::endBatch() {
  if (as_transaction_) queueCommand("COMMIT");
  if (unsent_ || PQpipelineSync(connection_.get()) == 0) return tl::unexpected<Reason>(lost());
  std::optional<Reason> wrong;
  bool committed = !as_transaction_;
  for (bool synced = false; !synced;) {
    const auto result = next();
    if (!result) return tl::unexpected<Reason>(result.error());
    if (PQstatus(connection_.get()) == CONNECTION_BAD) {
      const Answer owned(*result);
      return tl::unexpected<Reason>(lost());
    }
    if (*result == nullptr) continue;
    const Answer owned(*result);
    synced = PQresultStatus(*result) == PGRES_PIPELINE_SYNC;
    committed = committed || std::string_view(PQcmdStatus(*result)) == "COMMIT";
    const bool aborted = PQresultStatus(*result) == PGRES_PIPELINE_ABORTED;
    if (!isGood(*result) && !aborted && !wrong) wrong = reasonOf(*result);
  }
  if (PQexitPipelineMode(connection_.get()) == 0) return tl::unexpected<Reason>(lost());
  if (!wrong && committed) return {};
  // A failed statement of the pipeline leaves the transaction open.
  const auto ended = run("ROLLBACK");
  if (!ended) return ended;
  return tl::unexpected<Reason>(wrong.value_or(Reason{"server_refused", "it was not committed"}));
}

Result<std::optional<std::string>> Link::notification(std::chrono::milliseconds patience) {
  const auto until = Clock::now() + patience;
  for (;;) {
    if (PQconsumeInput(connection_.get()) == 0) return tl::unexpected<Reason>(lost());
    if (PGnotify* notify = PQnotifies(connection_.get())) {
      std::string payload = notify->extra;
      PQfreemem(notify);
      return std::optional(std::move(payload));
    }
    if (Clock::now() >= until) return std::optional<std::string>();
    const auto waited = wait(POLLIN, until);
    if (!waited && waited.error().code == "stopped") return tl::unexpected<Reason>(waited.error());
  }
}

}  // namespace perdure::map_store::fleet
