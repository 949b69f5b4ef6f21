#pragma once

namespace octosurf::test {

/// True under the address or the thread sanitizer: they reserve terabytes of address space, count memory in
/// their own malloc and slow everything down several times.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool sanitized = true;
#else
inline constexpr bool sanitized = false;
#endif

}  // namespace octosurf::test
