#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>

// What is fuzzed: each function reads `bytes` as a file of its kind and then does with what was accepted what
// a user would. It returns, whatever the bytes are: an Error is an answer. Any other exception, a crash, a
// result that breaks a promise of the headers (std::abort) and an endless loop are findings. `./dev
// fuzz-inputs` runs them under libFuzzer, test_fuzz replays the corpus and what was found.
namespace octosurf::fuzz {

using Bytes = std::span<const std::uint8_t>;

void fuzz_surfaces(Bytes bytes);  ///< a map file: invariants, planner's forms, an insert, save and reload
void fuzz_octomap(Bytes bytes);   ///< .bt and .ot: points of the occupied voxels, saved as .bt and read again
void fuzz_graph(Bytes bytes);
void fuzz_pcd(Bytes bytes);
void fuzz_ply(Bytes bytes);
void fuzz_image(Bytes bytes);   ///< PNG and PGM depth images, then as a camera's intrinsics
void fuzz_poses(Bytes bytes);   ///< pose files of all layouts, asked at times between
void fuzz_config(Bytes bytes);  ///< map --config
void fuzz_mcap(Bytes bytes);    ///< bags as inputs of map, with and without --skip-bad
void fuzz_db3(Bytes bytes);
void fuzz_bag(Bytes bytes);
void fuzz_message(Bytes bytes);  ///< a message of a bag, of the type and encoding that its first byte says

struct Target {
  std::string_view name;
  void (*run)(Bytes);
};
inline constexpr Target targets[] = {
    {"surfaces", fuzz_surfaces}, {"octomap", fuzz_octomap}, {"graph", fuzz_graph}, {"pcd", fuzz_pcd},
    {"ply", fuzz_ply},           {"image", fuzz_image},     {"poses", fuzz_poses}, {"config", fuzz_config},
    {"mcap", fuzz_mcap},         {"db3", fuzz_db3},         {"bag", fuzz_bag},     {"message", fuzz_message}};

/// Peak of the memory that reading took, of the input read last; 0 where nothing counts (libFuzzer has its
/// own limit).
extern std::size_t reading_peak;

/// A reader may take this much memory: so much whatever the file, and so many times the file.
inline constexpr std::size_t free_bytes = std::size_t{64} << 20, bytes_per_file_byte = 8;

/// Raises `peak` to the most memory that operator new gave out while one lived, beyond what it had at the
/// beginning; not at all in programs that do not link counted_new.cpp.
class PeakMemory {
 public:
  explicit PeakMemory(std::size_t& peak);
  PeakMemory(const PeakMemory&) = delete;
  PeakMemory& operator=(const PeakMemory&) = delete;
  ~PeakMemory();

 private:
  std::size_t& peak_;
  std::size_t before_ = 0;
};

/// Another map file of the kind of `file`, with a right checksum: what is behind the checksum is what
/// `mutate` comes to. `mutate(bytes)` changes a string in some way; `seed` decides everything else.
std::string mutated_map(std::string_view file, unsigned seed,
                        const std::function<void(std::string&)>& mutate);

}  // namespace octosurf::fuzz
