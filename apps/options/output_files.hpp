#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace octosurf {

/// Whether both names denote one file, existing or not: through relative paths, symbolic or hard links.
bool same_file(const std::filesystem::path& a, const std::filesystem::path& b);

/// A map's two files: `stem`.surfaces and `stem`.bt; a stem may be given with either ending.
std::vector<std::string> files_of_map(const std::string& stem);

/// Throws as io::NewFile for a file that cannot, or must not, be written. Empty names are ignored.
void require_writable(const std::string& file, bool force);
/// Likewise for a map's files, in a folder that is made if necessary.
void require_map_writable(const std::string& stem, bool force);

/// A map's name without folder and ending.
std::string title_of(const std::string& stem);

/// Throws Error(usage) if `output`, given with `option`, is one of `others`, or an existing file in one of
/// them that is a folder. A map's .surfaces stands for its lock, too. Empty names are ignored.
void require_apart(const std::string& option, const std::string& output,
                   const std::vector<std::string>& others);

/// All of this for a run's map, --report and --write-poses, before any work is done. `others`: its inputs.
void require_outputs(const std::string& stem, bool in_place, const std::string& report,
                     const std::string& poses, bool force, std::vector<std::string> others);

}  // namespace octosurf
