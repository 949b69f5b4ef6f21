#pragma once

#include <cstddef>

namespace octosurf::test {

// This program's write(), fsync(), fchmod(), rename() and renameat2() are failing_calls.cpp's.

/// The call after `n` more of them fails with `error`: only that one.
void fail_call_after(std::size_t n, int error);

/// No further call fails. Returns whether one has, since fail_call_after().
bool stop_failing_calls();

}  // namespace octosurf::test
