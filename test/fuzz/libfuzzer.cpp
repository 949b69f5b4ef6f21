// One target as a libFuzzer program: FUZZ_TARGET is its function. The mutator of map files is linked to that
// of `surfaces` only.
#include "fuzz/targets.hpp"
#ifdef FUZZ_MAP_RECORDS

#include <algorithm>
#endif

namespace octosurf::fuzz {

std::size_t reading_peak = 0;
PeakMemory::PeakMemory(std::size_t& peak) : peak_(peak) {}
PeakMemory::~PeakMemory() { peak_ = before_; }

}  // namespace octosurf::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  octosurf::fuzz::FUZZ_TARGET({data, size});
  return 0;
}

#ifdef FUZZ_MAP_RECORDS
extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned int seed) {
  constexpr std::size_t growth = 64;
  const auto mutate = [](std::string& bytes) {
    const std::size_t before = bytes.size();
    bytes.resize(before + growth);
    bytes.resize(LLVMFuzzerMutate(reinterpret_cast<std::uint8_t*>(bytes.data()), before, bytes.size()));
  };
  const std::string file =
      octosurf::fuzz::mutated_map({reinterpret_cast<const char*>(data), size}, seed, mutate);
  const std::size_t n = std::min(file.size(), max_size);
  std::copy_n(file.begin(), n, data);
  return n;
}
#endif
