#include "bench/speed/contest.hpp"

#include "bench/speed/channel.hpp"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <fcntl.h>
#include <iostream>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <octosurf/error.hpp>

namespace octosurf::bench {
namespace {

constexpr const char* contestant_flag = "--contestant";

double cpu_ms() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

/// Starts this program anew as a contestant; `socket` and `board` stay open in it, nothing else does.
pid_t start(const std::string& kind, const Json& settings, int socket, int board) {
  const std::string socket_text = std::to_string(socket), board_text = std::to_string(board);
  const std::string settings_text = settings.dump();
  const pid_t pid = fork();
  if (pid < 0) throw Error(Error::Kind::data, "contestant " + kind, "cannot be started");
  if (pid > 0) return pid;
  fcntl(socket, F_SETFD, 0);
  fcntl(board, F_SETFD, 0);
  execl("/proc/self/exe", "bench_speed", contestant_flag, kind.c_str(), settings_text.c_str(),
        socket_text.c_str(), board_text.c_str(), nullptr);
  _exit(127);
}

}  // namespace

class Contest::Board : public ScanBoard {};

struct Contest::Entry {
  std::string name;
  pid_t pid = -1;
  int socket = -1;
  std::vector<Turn> turns;

  ~Entry() {
    close(socket);  // its sign to end
    waitpid(pid, nullptr, 0);
  }

  Json call(const Json& message) {
    send(socket, message);
    const std::optional<Json> answer = receive(socket);
    if (!answer) throw Error(Error::Kind::data, "contestant " + name, "died");
    if (const auto error = answer->find("error"); error != answer->end())
      throw Error(Error::Kind::data, "contestant " + name, error->get<std::string>());
    return answer->at("answer");
  }
};

Contest::Contest() : board_(std::make_unique<Board>()) {}
Contest::~Contest() = default;

void Contest::enter(const std::string& name, const std::string& kind, const Json& settings) {
  int sockets[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, sockets) != 0)
    throw Error(Error::Kind::data, "contestant " + name, "no socket");
  auto added = std::make_unique<Entry>();
  added->name = name;
  added->socket = sockets[0];
  added->pid = start(kind, settings, sockets[1], board_->file());
  close(sockets[1]);
  added->call({{"do", "greet"}});
  entries_.push_back(std::move(added));
}

Contest::Entry& Contest::entry(const std::string& name) const {
  for (const auto& entry : entries_)
    if (entry->name == name) return *entry;
  throw Error(Error::Kind::usage, "contestant " + name, "has not entered");
}

void Contest::play(bool with_scan) {
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    const std::string& name = entries_[(i + rounds_) % entries_.size()]->name;
    if (with_scan) entry(name).call({{"do", "prepare"}});
    run(name);
  }
  ++rounds_;
}

void Contest::turn(const Scan& scan) {
  board_->write(scan);
  play(true);
}

void Contest::turn() { play(false); }

void Contest::prepare(const std::string& name, const Scan& scan) {
  board_->write(scan);
  entry(name).call({{"do", "prepare"}});
}

Turn Contest::run(const std::string& name) {
  Entry& runner = entry(name);
  const Json answer = runner.call({{"do", "run"}});
  Turn turn{answer.at("ms").get<double>(), answer.at("cpu_ms").get<double>(), {}};
  if (const Json& stages = answer.at("stages"); !stages.is_null())
    turn.stage_ms = stages.get<std::vector<double>>();
  runner.turns.push_back(turn);
  return turn;
}

Json Contest::ask(const std::string& name, const Json& question) {
  return entry(name).call({{"do", "tell"}, {"question", question}});
}

const std::vector<Turn>& Contest::turns(const std::string& name) const { return entry(name).turns; }

namespace {

Json answer_to(const Json& message, Contestant& contestant, const ScanBoard& board, Scan& scan) {
  const std::string what = message.at("do").get<std::string>();
  if (what == "prepare") {
    board.read(scan);
    contestant.prepare(scan);
  } else if (what == "run") {
    using Clock = std::chrono::steady_clock;
    const double cpu_before = cpu_ms();
    const auto before = Clock::now();
    contestant.run();
    const double ms = std::chrono::duration<double, std::milli>(Clock::now() - before).count();
    return {{"ms", ms}, {"cpu_ms", cpu_ms() - cpu_before}, {"stages", contestant.stages()}};
  } else if (what == "tell") {
    scan = Scan();  // a heap it measures shall be its own
    return contestant.tell(message.at("question"));
  }
  return nullptr;
}

}  // namespace

bool serve_contestant(int argc, char** argv) {
  if (argc != 6 || std::string(argv[1]) != contestant_flag) return false;
  std::cerr.setstate(std::ios::failbit);  // OctoMap tells there what it reads and writes
  const int socket = std::atoi(argv[4]);
  const ScanBoard board(std::atoi(argv[5]));
  Scan scan;
  std::unique_ptr<Contestant> contestant;
  while (const std::optional<Json> message = receive(socket)) {
    try {
      if (!contestant) contestant = make_contestant(argv[2], Json::parse(argv[3]));
      send(socket, {{"answer", answer_to(*message, *contestant, board, scan)}});
    } catch (const std::exception& error) {
      send(socket, {{"error", error.what()}});
    }
  }
  _exit(0);  // taking a large tree apart node by node is of no use now
}

}  // namespace octosurf::bench
