#pragma once

#include <cstdint>
#include <istream>
#include <string>
#include <string_view>

namespace octosurf::io {

/// What stands before the records of a scan's archive: 8 bytes of magic and the format's version, 4 bytes,
/// least significant first.
struct FileBeginning {
  std::string_view magic;
  std::uint32_t newest_version;
  const char* what;     ///< "an archived scan"
  const char* made_by;  ///< "octosurf map --keep-scans"
};

/// `in` behind its beginning. Throws Error(data) about `where` if it is another file's, or one of a newer
/// octosurf.
std::istream& after_beginning(std::istream& in, const std::string& where, const FileBeginning& expected);

}  // namespace octosurf::io
