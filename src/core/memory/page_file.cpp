#include "memory/page_file.hpp"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstdlib>
#include <fcntl.h>
#include <sys/mman.h>
#include <system_error>
#include <unistd.h>

#include <octosurf/error.hpp>

namespace octosurf::memory {
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

}  // namespace

void PageFile::fail(int cause) const {
  throw Error(Error::Kind::output, folder_,
              "no scratch file for a limit of memory: " + std::generic_category().message(cause),
              cause == ENOSPC ? "free space on that disk" : "choose another folder, or no limit");
}

void PageFile::grow(std::size_t end) {
  const std::size_t before = mapped_;
  const std::size_t size = (end - before + segment - 1) / segment * segment;
  if (before + size > most) throw std::bad_alloc();
  int cause = EINTR;
  while (cause == EINTR)
    cause = ::posix_fallocate(descriptor_, static_cast<off_t>(before), static_cast<off_t>(size));
  if (cause != 0) fail(cause);
  if (::mmap(begin_ + before, size, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_FIXED, descriptor_,
             static_cast<off_t>(before)) == MAP_FAILED)
    throw std::bad_alloc();
  mapped_ = before + size;
}

PageFile::PageFile(const std::filesystem::path& folder) : PageFile() {  // what throws below destroys it
  folder_ = folder.empty() ? "." : folder.string();
  descriptor_ = ::open(folder_.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC | O_EXCL, 0600);
  if (descriptor_ < 0) {  // file systems that know no file without a name
    std::string name = folder_ + "/.octosurf-XXXXXX";
    descriptor_ = ::mkostemp(name.data(), O_CLOEXEC);
    if (descriptor_ < 0) fail(errno);
    ::unlink(name.c_str());
  }
  void* const addresses =
      ::mmap(nullptr, most, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (addresses == MAP_FAILED) fail(errno);
  begin_ = static_cast<std::byte*>(addresses);
  grow(segment);  // a full disk shows at once
}

PageFile::~PageFile() {
  if (begin_ != nullptr) ::munmap(begin_, most);
  if (descriptor_ >= 0) ::close(descriptor_);
}

void* PageFile::allocate(std::size_t bytes) {
  const std::size_t size = rounded(std::max<std::size_t>(bytes, 1)), alignment = size >= page ? page : 64;
  const std::lock_guard lock(mutex_);
  std::vector<void*>& spare = free_[class_of(size)];
  if (!spare.empty()) {
    void* block = spare.back();
    spare.pop_back();
    return block;
  }
  const std::size_t at = (used_ + alignment - 1) / alignment * alignment;
  if (at + size > mapped_) grow(at + size);
  used_ = at + size;
  return begin_ + at;
}

void PageFile::deallocate(void* block, std::size_t bytes) noexcept {
  const std::lock_guard lock(mutex_);
  try {
    free_[class_of(rounded(std::max<std::size_t>(bytes, 1)))].push_back(block);
  } catch (const std::bad_alloc&) {  // never reused
  }
}

void PageFile::drop(std::size_t keep) noexcept {
  const std::size_t used = used_, end = keep == 0 ? mapped_.load() : used - std::min(keep, used);
  ::madvise(begin_, end / page * page, MADV_DONTNEED);
}

}  // namespace octosurf::memory
