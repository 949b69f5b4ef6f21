#pragma once

#include <cstddef>

namespace octosurf::test {

// This program's operator new is failing_memory.cpp's, which fails when it is told to. Counted and failed are
// all allocations of the process, whatever thread asks for them.

/// Allocations since the program began.
std::size_t allocations();

/// The allocation after `n` more of them fails: only that one, or with `all_after` each from there on.
void fail_allocation_after(std::size_t n, bool all_after = false);

/// No further allocation fails. Returns how many did since fail_allocation_after().
std::size_t stop_failing();

}  // namespace octosurf::test
