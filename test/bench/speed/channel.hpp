#pragma once

#include "bench/speed/contestant.hpp"

#include <cstddef>
#include <optional>

namespace octosurf::bench {

/// Messages over a socket, each behind its length. Throws Error(data) if the other side is gone.
void send(int socket, const Json& message);
/// Nothing: the other side has closed.
std::optional<Json> receive(int socket);

/// One scan in memory that processes share.
class ScanBoard {
 public:
  ScanBoard();                             ///< an empty one
  explicit ScanBoard(int inherited_file);  ///< the one of another process
  ~ScanBoard();
  ScanBoard(const ScanBoard&) = delete;
  ScanBoard& operator=(const ScanBoard&) = delete;

  int file() const { return file_; }
  void write(const Scan& scan);
  /// Into `scan`, whose memory is used again.
  void read(Scan& scan) const;

 private:
  struct Head;
  void map();
  int file_ = -1;
  std::byte* memory_ = nullptr;
};

}  // namespace octosurf::bench
