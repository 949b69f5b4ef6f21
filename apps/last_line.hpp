#pragma once

#include "checkpoints.hpp"

#include <array>
#include <exception>

namespace octosurf {

/// The line that a run ends with when it fails, thrown to main(). Its text has its own place, because it may
/// be told when no memory is left.
class LastLine : public std::exception {
 public:
  /// As printf; what does not fit is cut off.
  [[gnu::format(printf, 2, 3)]] void add(const char* format, ...);
  /// Which checkpoint is the last complete one, or that there is none.
  void add_last_of(const Checkpoints& checkpoints);

  const char* what() const noexcept override { return text_.data(); }

 private:
  std::array<char, 2048> text_{};
};

/// what(), or words for what has none. Valid as long as the exception.
const char* reason_of(const std::exception& error);

}  // namespace octosurf
