#include "geometry/page_file.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <fcntl.h>
#include <memory>
#include <mutex>
#include <new>
#include <string>
#include <sys/mman.h>
#include <system_error>
#include <unistd.h>
#include <vector>

#include <octosurf/error.hpp>

namespace octosurf::geometry {
namespace {

constexpr std::size_t page = 4096;
/// Reserved on the disk at a time: a call to the system for each hundred chunks of the octree.
constexpr std::size_t segment = std::size_t{16} << 20;
/// Addresses set aside, which cost nothing: the largest octree, 2^16 voxels an axis, is far smaller in
/// practice.
constexpr std::size_t most = std::size_t{1} << 40;

/// Eight sizes to an octave, so that at most an eighth of a block is unused.
std::size_t rounded(std::size_t bytes) {
  const std::size_t step = std::max<std::size_t>(std::bit_floor(bytes) / 8, 16);
  return (bytes + step - 1) / step * step;
}
std::size_t class_of(std::size_t size) {
  const auto octave = static_cast<std::size_t>(std::bit_width(size));
  return 8 * octave + (octave > 4 ? size >> (octave - 4) & 7 : 0);
}

struct File {
  std::string folder;
  int descriptor = -1;
  std::byte* begin = nullptr;
  std::mutex mutex;                               // guards the rest
  std::atomic<std::size_t> used = 0, mapped = 0;  // read by drop()
  std::array<std::vector<void*>, 512> free;

  void* take(std::size_t bytes);
  void give(void* block, std::size_t bytes) noexcept;
  void grow(std::size_t end);
  [[noreturn]] void fail(int cause) const;
};

/// Set once, never deleted: what is allocated from it may be freed as late as the process ends.
std::atomic<File*> file = nullptr;

void File::fail(int cause) const {
  throw Error(Error::Kind::output, folder,
              "no scratch file for --max-memory: " + std::generic_category().message(cause),
              cause == ENOSPC ? "free space on that disk" : "choose another folder, or give no --max-memory");
}

void File::grow(std::size_t end) {
  const std::size_t before = mapped;
  const std::size_t size = (end - before + segment - 1) / segment * segment;
  if (before + size > most) throw std::bad_alloc();
  int cause = EINTR;
  while (cause == EINTR)
    cause = ::posix_fallocate(descriptor, static_cast<off_t>(before), static_cast<off_t>(size));
  if (cause != 0) fail(cause);
  if (::mmap(begin + before, size, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_FIXED, descriptor,
             static_cast<off_t>(before)) == MAP_FAILED)
    throw std::bad_alloc();
  mapped = before + size;
}

void* File::take(std::size_t bytes) {
  const std::size_t size = rounded(bytes), alignment = size >= page ? page : 64;
  const std::lock_guard lock(mutex);
  std::vector<void*>& spare = free[class_of(size)];
  if (!spare.empty()) {
    void* block = spare.back();
    spare.pop_back();
    return block;
  }
  const std::size_t at = (used + alignment - 1) / alignment * alignment;
  if (at + size > mapped) grow(at + size);
  used = at + size;
  return begin + at;
}

void File::give(void* block, std::size_t bytes) noexcept {
  const std::lock_guard lock(mutex);
  try {
    free[class_of(rounded(bytes))].push_back(block);
  } catch (const std::bad_alloc&) {  // never reused
  }
}

bool within(const File& of, const void* block) {
  const auto at = reinterpret_cast<std::uintptr_t>(block), from = reinterpret_cast<std::uintptr_t>(of.begin);
  return at >= from && at < from + most;
}

}  // namespace

void PageFile::open(const std::filesystem::path& folder) {
  if (file != nullptr) throw Error(Error::Kind::usage, folder.string(), "there is a scratch file already");
  auto opened = std::make_unique<File>();
  opened->folder = folder.empty() ? "." : folder.string();
  opened->descriptor = ::open(opened->folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC | O_EXCL, 0600);
  if (opened->descriptor < 0) {  // file systems that know no file without a name
    std::string name = opened->folder + "/.octosurf-XXXXXX";
    opened->descriptor = ::mkostemp(name.data(), O_CLOEXEC);
    if (opened->descriptor < 0) opened->fail(errno);
    ::unlink(name.c_str());
  }
  void* const addresses =
      ::mmap(nullptr, most, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (addresses == MAP_FAILED) {
    const int cause = errno;
    ::close(opened->descriptor);
    opened->fail(cause);
  }
  opened->begin = static_cast<std::byte*>(addresses);
  opened->grow(segment);  // a full disk shows at once
  file = opened.release();
}

void* PageFile::allocate(std::size_t bytes) {
  File* const from = file.load(std::memory_order_relaxed);
  return from == nullptr ? ::operator new(bytes) : from->take(std::max<std::size_t>(bytes, 1));
}

void PageFile::deallocate(void* block, std::size_t bytes) noexcept {
  File* const from = file.load(std::memory_order_relaxed);
  if (from != nullptr && within(*from, block))
    from->give(block, std::max<std::size_t>(bytes, 1));
  else
    ::operator delete(block);
}

void PageFile::drop(std::size_t keep) noexcept {
  const File* const of = file.load();
  if (of == nullptr) return;
  const std::size_t used = of->used, end = keep == 0 ? of->mapped.load() : used - std::min(keep, used);
  ::madvise(of->begin, end / page * page, MADV_DONTNEED);
}

}  // namespace octosurf::geometry
