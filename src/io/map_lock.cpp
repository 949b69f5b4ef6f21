#include "io/map_lock.hpp"

#include "io/new_file.hpp"
#include "io/text_file.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <fcntl.h>
#include <map>
#include <mutex>
#include <sys/file.h>
#include <unistd.h>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

namespace fs = std::filesystem;

/// What the holder wrote: "process 123 of HOST", empty if it has not yet.
std::string holder_in(int descriptor) {
  std::array<char, 512> text{};
  const ssize_t size = std::max<ssize_t>(::pread(descriptor, text.data(), text.size(), 0), 0);
  return printable({text.data(), std::find(text.data(), text.data() + size, '\n')});
}

}  // namespace

struct MapLock::Held {
  explicit Held(fs::path path) : file(std::move(path)) {}
  Held(const Held&) = delete;
  Held& operator=(const Held&) = delete;
  ~Held() {
    if (descriptor < 0) return;
    if (locked && process == ::getpid()) ::unlink(file.c_str());
    ::close(descriptor);  // last: it frees the lock, unless it is a forked child's copy
  }

  void take() {
    do {  // the one before may have removed the file after it was opened here
      if (descriptor >= 0) ::close(descriptor);
      descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0666);
      if (descriptor < 0) fail();
      if (::flock(descriptor, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
        throw Error(Error::Kind::output, file.string(), holder_in(descriptor) + " is writing the map",
                    "wait until it ends, or name another map to write");
    } while (!is_at(descriptor, file));
    std::array<char, 256> host{};
    ::gethostname(host.data(), host.size() - 1);
    const std::string own = "process " + std::to_string(process) + " of " + host.data() + "\n";
    locked = true;
    if (::ftruncate(descriptor, 0) != 0 || ::pwrite(descriptor, own.data(), own.size(), 0) < 0) fail();
  }

  [[noreturn]] void fail() const { fail_to_write(file, "cannot be written", errno); }

  fs::path file;
  const pid_t process = ::getpid();  // a forked child has a copy of this, but not the lock
  int descriptor = -1;
  bool locked = false;
};

MapLock::MapLock(const fs::path& stem) {
  require_map_name(stem);
  static std::mutex mutex;
  static std::map<fs::path, std::weak_ptr<Held>> all;
  const fs::path file = file_of_map(stem, ".lock");
  const std::lock_guard lock(mutex);
  std::error_code ignored;
  std::weak_ptr<Held>& known = all[fs::weakly_canonical(fs::absolute(file, ignored), ignored)];
  held_ = known.lock();
  if (held_ && held_->process == ::getpid()) return;
  auto held = std::make_shared<Held>(file);
  held->take();
  known = held_ = std::move(held);
}

}  // namespace octosurf::io
