#include "io/map_file/file_beginning.hpp"

#include <octosurf/error.hpp>

namespace octosurf::io {

std::istream& after_beginning(std::istream& in, const std::string& where, const FileBeginning& expected) {
  if (!in) throw Error(Error::Kind::data, where, "cannot be read", "check the path and its rights");
  const std::size_t magic = expected.magic.size();
  std::string head(magic + 4, '\0');
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  if (!std::string_view(head).substr(0, static_cast<std::size_t>(in.gcount())).starts_with(expected.magic))
    throw Error(Error::Kind::data, where, std::string("is not ") + expected.what,
                std::string("expected a file of ") + expected.made_by);
  const auto require = [&](bool holds, const char* what) {
    if (!holds)
      throw Error(Error::Kind::data, where, std::string("is damaged: ") + what, "restore it from a backup");
  };
  require(static_cast<bool>(in), "it ends too early");
  std::uint32_t version = 0;
  for (std::size_t i = 0; i < 4; ++i)
    version |= std::uint32_t{static_cast<unsigned char>(head[magic + i])} << (8 * i);
  require(version > 0, "it has no version");
  if (version > expected.newest_version)
    throw Error(Error::Kind::data, where,
                "has version " + std::to_string(version) + " of the format, this octosurf reads up to " +
                    std::to_string(expected.newest_version),
                "use the newer version that wrote it");
  return in;
}

}  // namespace octosurf::io
