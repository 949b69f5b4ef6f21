#pragma once

#include "checkpoints.hpp"

#include <array>
#include <exception>

namespace octosurf {

/// The last line of a failed run, thrown to main(). Its text is preallocated, because there may be no memory
/// left.
class LastLine : public std::exception {
 public:
  /// As printf; longer text is truncated.
  [[gnu::format(printf, 2, 3)]] void add(const char* format, ...);
  /// Names the last complete checkpoint, or says that there is none.
  void add_last_of(const Checkpoints& checkpoints);

  const char* what() const noexcept override { return text_.data(); }

 private:
  std::array<char, 2048> text_{};
};

/// what(), or words for what has none. Valid as long as the exception.
const char* reason_of(const std::exception& error);

}  // namespace octosurf
