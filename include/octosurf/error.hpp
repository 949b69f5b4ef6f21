#pragma once

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

namespace octosurf {

/// The one exception of the library: what failed, where, and how to fix it.
///
/// `what()` is a single line `where: what; hint`, ready for a log. The library never prints or aborts: every
/// failure is an Error (or std::bad_alloc; mapper.hpp says how to handle it).
class Error : public std::runtime_error {
 public:
  /// Category of the failure: who must act.
  enum class Kind {
    usage,      ///< invalid arguments, parameters or options
    data,       ///< a file, image, cloud or pose is missing, damaged or of an unknown format
    output,     ///< a result could not be written
    incomplete  ///< a failed scan could not be rolled back yet, for lack of memory (Mapper, 4)
  };

  /// `where` names a file, a parameter or a scan; `hint` says how to fix it (may be empty). A NUL in them, as
  /// in a frame's name out of a damaged message, becomes a blank, lest what() end there.
  Error(Kind kind, std::string where, const std::string& what, std::string hint = {})
      : std::runtime_error(without_nul((where.empty() ? std::string() : where + ": ") + what +
                                       (hint.empty() ? std::string() : "; " + hint))),
        kind_(kind),
        where_(without_nul(std::move(where))),
        hint_(without_nul(std::move(hint))) {}

  Kind kind() const noexcept { return kind_; }                  ///< category
  const std::string& where() const noexcept { return where_; }  ///< file, parameter or scan; may be empty
  const std::string& hint() const noexcept { return hint_; }    ///< how to fix it; may be empty

 private:
  static std::string without_nul(std::string text) {
    std::replace(text.begin(), text.end(), '\0', ' ');
    return text;
  }

  Kind kind_;
  std::string where_;
  std::string hint_;
};

}  // namespace octosurf
