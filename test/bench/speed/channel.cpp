#include "bench/speed/channel.hpp"

#include <cerrno>
#include <cstring>
#include <string>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <octosurf/error.hpp>

namespace octosurf::bench {
namespace {

[[noreturn]] void fail(const std::string& what) {
  throw Error(Error::Kind::data, "contestant", what + ": " + std::strerror(errno));
}

bool receive_all(int socket, char* to, std::size_t bytes) {
  for (std::size_t done = 0; done < bytes;) {
    const ssize_t got = ::recv(socket, to + done, bytes - done, 0);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    done += static_cast<std::size_t>(got);
  }
  return true;
}

void send_all(int socket, const char* from, std::size_t bytes) {
  for (std::size_t done = 0; done < bytes;) {
    const ssize_t sent = ::send(socket, from + done, bytes - done, MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) fail("is gone");
    done += static_cast<std::size_t>(sent);
  }
}

}  // namespace

void send(int socket, const Json& message) {
  const std::string text = message.dump();
  const std::uint64_t bytes = text.size();
  send_all(socket, reinterpret_cast<const char*>(&bytes), sizeof bytes);
  send_all(socket, text.data(), text.size());
}

std::optional<Json> receive(int socket) {
  std::uint64_t bytes = 0;
  if (!receive_all(socket, reinterpret_cast<char*>(&bytes), sizeof bytes)) return std::nullopt;
  std::string text(bytes, '\0');
  if (!receive_all(socket, text.data(), text.size())) return std::nullopt;
  return Json::parse(text);
}

struct ScanBoard::Head {
  std::size_t points = 0;
  double T_map_sensor[16] = {};
  double stamp_s = 0;
  SensorKind sensor = SensorKind::depth_camera;
};

namespace {
constexpr std::size_t board_bytes = std::size_t{1} << 30;  // address space; pages come when written to
}

ScanBoard::ScanBoard() : file_(::memfd_create("scan", MFD_CLOEXEC)) {
  if (file_ < 0 || ::ftruncate(file_, board_bytes) != 0) fail("no shared memory");
  map();
  new (memory_) Head();
}

ScanBoard::ScanBoard(int inherited_file) : file_(inherited_file) { map(); }

ScanBoard::~ScanBoard() {
  ::munmap(memory_, board_bytes);
  ::close(file_);
}

void ScanBoard::map() {
  void* const memory = ::mmap(nullptr, board_bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file_, 0);
  if (memory == MAP_FAILED) fail("no shared memory");
  memory_ = static_cast<std::byte*>(memory);
}

void ScanBoard::write(const Scan& scan) {
  const std::size_t bytes = scan.points.size() * sizeof(Eigen::Vector3f);
  if (sizeof(Head) + bytes > board_bytes)
    throw Error(Error::Kind::data, scan.name, "has too many points for the benchmark");
  Head head;
  head.points = scan.points.size();
  Eigen::Map<Eigen::Matrix4d>(head.T_map_sensor) = scan.T_map_sensor.matrix();
  head.stamp_s = scan.stamp_s;
  head.sensor = scan.sensor;
  std::memcpy(memory_, &head, sizeof head);
  if (bytes > 0) std::memcpy(memory_ + sizeof head, scan.points.data(), bytes);
}

void ScanBoard::read(Scan& scan) const {
  Head head;
  std::memcpy(&head, memory_, sizeof head);
  scan.points.resize(head.points);
  if (head.points > 0)
    std::memcpy(static_cast<void*>(scan.points.data()), memory_ + sizeof head,
                head.points * sizeof(Eigen::Vector3f));
  scan.T_map_sensor.matrix() = Eigen::Map<const Eigen::Matrix4d>(head.T_map_sensor);
  scan.stamp_s = head.stamp_s;
  scan.sensor = head.sensor;
}

}  // namespace octosurf::bench
