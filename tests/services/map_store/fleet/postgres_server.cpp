#include "tests/services/map_store/fleet/postgres_server.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <grp.h>
#include <pwd.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <vector>

#include "services/map_store/fleet/link.h"

namespace perdure::map_store::test {
namespace {

namespace fs = std::filesystem;
constexpr char kPassword[] = "hush-3c1f";

/// The folder of initdb and postgres; empty if they are not installed.
std::string findPrograms() {
  std::error_code ignored;
  for (const auto& version : fs::directory_iterator("/usr/lib/postgresql", ignored)) {
    const fs::path bin = version.path() / "bin";
    if (fs::exists(bin / "initdb") && fs::exists(bin / "postgres")) return bin.string();
  }
  return {};
}

bool findPostgis() {
  std::error_code ignored;
  for (const auto& version : fs::directory_iterator("/usr/share/postgresql", ignored)) {
    if (fs::exists(version.path() / "extension/postgis.control")) return true;
  }
  return false;
}

/// PostgreSQL refuses to run as root.
const passwd* unprivileged() {
  if (geteuid() != 0) return nullptr;
  const passwd* user = getpwnam("postgres");
  return user != nullptr ? user : getpwnam("nobody");
}

pid_t spawn(std::vector<std::string> words, const std::string& log) {
  const passwd* user = unprivileged();
  const pid_t child = fork();
  if (child != 0) return child;
  prctl(PR_SET_PDEATHSIG, SIGQUIT);
  const int out = open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0666);
  dup2(out, 1);
  dup2(out, 2);
  if (user != nullptr &&
      (setgroups(0, nullptr) != 0 || setgid(user->pw_gid) != 0 || setuid(user->pw_uid) != 0)) {
    _exit(126);
  }
  prctl(PR_SET_PDEATHSIG, SIGQUIT);  // a change of user clears this setting
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  execv(arguments[0], arguments.data());
  _exit(127);
}

int freePort() {
  const int file = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  if (bind(file, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
      getsockname(file, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    throw std::runtime_error("no free port");
  }
  close(file);
  return ntohs(address.sin_port);
}

void give(const fs::path& path) {
  const passwd* user = unprivileged();
  if (user != nullptr && chown(path.c_str(), user->pw_uid, user->pw_gid) != 0) {
    throw std::runtime_error("the folder cannot be given away");
  }
}

fleet::Link linkTo(const std::string& url) {
  static const fleet::Stop stop;
  auto link = fleet::Link::open(url, {}, stop);
  if (!link) throw std::runtime_error(link.error().code + ": " + link.error().detail);
  return std::move(*link);
}

}  // namespace

PostgresServer* PostgresServer::get() {
  static const std::string programs = findPrograms();
  if (programs.empty()) return nullptr;
  static const std::unique_ptr<PostgresServer> server(new PostgresServer(programs, findPostgis()));
  return server.get();
}

PostgresServer::PostgresServer(std::string programs, bool has_postgis)
    : programs_(std::move(programs)), has_postgis_(has_postgis), port_(freePort()) {
  give(folder_.path());
  initialise();
  start();
  if (!has_postgis_) return;
  run(url("postgres"), "CREATE DATABASE with_postgis TEMPLATE template0");
  run(url("with_postgis"), "CREATE EXTENSION postgis");
}

PostgresServer::~PostgresServer() {
  if (process_ > 0) crash();
}

void PostgresServer::initialise() {
  std::ofstream(folder_.file("password")) << kPassword << "\n";
  const pid_t child =
      spawn({programs_ + "/initdb", "-D", folder_.file("data"), "-U", "boss", "-A", "scram-sha-256",
             "--pwfile=" + folder_.file("password"), "-E", "UTF8", "--locale=C", "-N"},
            folder_.file("initdb.log"));
  int status = 0;
  waitpid(child, &status, 0);
  if (status != 0) throw std::runtime_error("initdb failed: " + folder_.file("initdb.log"));
}

std::string PostgresServer::passfile(const std::string& password) const {
  const std::string path = folder_.file("pass-" + password);
  std::ofstream(path) << "*:*:*:*:" << password << "\n";
  fs::permissions(path, fs::perms::owner_read | fs::perms::owner_write);
  return path;
}

std::string PostgresServer::url(const std::string& database) const {
  return "postgresql://boss@127.0.0.1:" + std::to_string(port_) + "/" + database +
         "?passfile=" + passfile(kPassword);
}

std::string PostgresServer::through(int port, const std::string& url) {
  const std::size_t from = url.find("127.0.0.1:") + 10;
  return url.substr(0, from) + std::to_string(port) + url.substr(url.find('/', from));
}

std::string PostgresServer::makeDatabase(bool with_postgis) {
  const std::string name = "fleet" + std::to_string(++databases_);
  run(url("postgres"), "CREATE DATABASE " + name + " TEMPLATE " +
                           (with_postgis && has_postgis_ ? "with_postgis" : "template0"));
  return url(name);
}

void PostgresServer::dropDatabase(const std::string& database_url) {
  const std::size_t from = database_url.find('/', 13) + 1;
  const std::string name = database_url.substr(from, database_url.find('?') - from);
  run(url("postgres"), "DROP DATABASE " + name + " WITH (FORCE)");
}

void PostgresServer::crash() {
  kill(process_, SIGQUIT);
  int status = 0;
  waitpid(process_, &status, 0);
  process_ = 0;
}

void PostgresServer::start() {
  process_ = spawn({programs_ + "/postgres", "-D", folder_.file("data"), "-k",
                    folder_.path().string(), "-h", "127.0.0.1", "-p", std::to_string(port_), "-c",
                    "fsync=off", "-c", "max_wal_size=256MB", "-c", "shared_buffers=32MB"},
                   folder_.file("postgres.log"));
  for (int tries = 0; tries < 600; ++tries) {
    static const fleet::Stop stop;
    if (fleet::Link::open(url("postgres"), {}, stop)) return;
    usleep(100'000);
  }
  throw std::runtime_error("the server does not start: " + folder_.file("postgres.log"));
}

void PostgresServer::run(const std::string& database_url, const std::string& sql) {
  const auto done = linkTo(database_url).run(sql);
  if (!done) throw std::runtime_error(done.error().code + ": " + done.error().detail);
}

std::int64_t PostgresServer::number(const std::string& database_url, const std::string& sql) {
  fleet::Link link = linkTo(database_url);
  const auto answer = link.ask(sql);
  if (!answer) throw std::runtime_error(answer.error().code + ": " + answer.error().detail);
  return answer->rows() == 0 ? -1 : answer->integer(0, 0);
}

}  // namespace perdure::map_store::test
