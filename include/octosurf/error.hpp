#pragma once

#include <stdexcept>
#include <string>
#include <utility>

namespace octosurf {

/// The one exception of the library: what failed, where, and how to mend it.
///
/// `what()` is a single line `where: what; mend`, ready for a log. Nothing in the library prints
/// or aborts: whatever goes wrong arrives as an Error (or as std::bad_alloc; mapper.hpp says what a caller
/// does then).
class Error : public std::runtime_error {
 public:
  /// What sort of failure it is, and so who has to act.
  enum class Kind {
    usage,      ///< the caller asked for something that makes no sense (parameters, options)
    data,       ///< a file, an image, a cloud or a pose is missing, damaged or foreign
    output,     ///< a result could not be written
    incomplete  ///< a scan that failed is not taken back yet, for want of memory (Mapper, 4)
  };

  /// `where` names a file, a parameter or a scan; `mend` tells what to do about it (may be empty).
  Error(Kind kind, std::string where, const std::string& what, std::string mend = {})
      : std::runtime_error((where.empty() ? std::string() : where + ": ") + what +
                           (mend.empty() ? std::string() : "; " + mend)),
        kind_(kind),
        where_(std::move(where)),
        mend_(std::move(mend)) {}

  Kind kind() const noexcept { return kind_; }                  ///< what sort of failure
  const std::string& where() const noexcept { return where_; }  ///< file, parameter or scan; may be empty
  const std::string& mend() const noexcept { return mend_; }    ///< what to do about it; may be empty

 private:
  Kind kind_;
  std::string where_;
  std::string mend_;
};

}  // namespace octosurf
