#pragma once

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

  /// `where` names a file, a parameter or a scan; `hint` says how to fix it (may be empty).
  Error(Kind kind, std::string where, const std::string& what, std::string hint = {})
      : std::runtime_error((where.empty() ? std::string() : where + ": ") + what +
                           (hint.empty() ? std::string() : "; " + hint)),
        kind_(kind),
        where_(std::move(where)),
        hint_(std::move(hint)) {}

  Kind kind() const noexcept { return kind_; }                  ///< category
  const std::string& where() const noexcept { return where_; }  ///< file, parameter or scan; may be empty
  const std::string& hint() const noexcept { return hint_; }    ///< how to fix it; may be empty

 private:
  Kind kind_;
  std::string where_;
  std::string hint_;
};

}  // namespace octosurf
