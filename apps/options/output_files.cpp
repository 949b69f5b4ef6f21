#include "output_files.hpp"

#include "io/new_file.hpp"

#include <algorithm>
#include <system_error>

#include <octosurf/error.hpp>

namespace octosurf {
namespace {

namespace fs = std::filesystem;

fs::path resolved(const fs::path& path) {
  std::error_code ignored;
  return fs::weakly_canonical(fs::absolute(path, ignored), ignored);
}

bool is_in(const fs::path& file, const fs::path& folder) {
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored) || !fs::exists(file, ignored)) return false;
  const fs::path inner = resolved(file), outer = resolved(folder);
  return std::mismatch(outer.begin(), outer.end(), inner.begin(), inner.end()).first == outer.end();
}

}  // namespace

bool same_file(const fs::path& a, const fs::path& b) {
  std::error_code failure;
  return fs::equivalent(a, b, failure) || resolved(a) == resolved(b);
}

std::vector<std::string> files_of_map(const std::string& stem) {
  return {io::file_of_map(stem, ".surfaces").string(), io::file_of_map(stem, ".bt").string()};
}

void require_writable(const std::string& file, bool force) {
  if (!file.empty()) io::NewFile(file, force).write([](std::ostream&) {});
}

void require_map_writable(const std::string& stem, bool force) {
  io::require_map_name(stem);
  const fs::path folder = fs::path(stem).parent_path();
  std::error_code failure;
  if (!folder.empty()) fs::create_directories(folder, failure);
  if (failure)
    throw Error(Error::Kind::output, stem, "its folder cannot be made: " + failure.message(),
                "choose another place for the map");
  for (const std::string& file : files_of_map(stem)) require_writable(file, force);
}

std::string title_of(const std::string& stem) { return io::file_of_map(stem, "").filename().string(); }

void require_apart(const std::string& option, const std::string& output,
                   const std::vector<std::string>& others) {
  for (const std::string& other : others) {
    if (output.empty() || other.empty()) continue;
    if (other.ends_with(".surfaces"))  // which stands for its lock
      if (same_file(output, io::file_of_map(other, ".lock")))
        throw Error(Error::Kind::usage, option + " " + output, "is kept with the map " + other,
                    "give another name");
    if (same_file(output, other))
      throw Error(Error::Kind::usage, option + " " + output, "is the file " + other + " itself",
                  "give another name");
    if (is_in(output, other))
      throw Error(Error::Kind::usage, option + " " + output, "is a file of the input " + other,
                  "give another name");
  }
}

void require_outputs(const std::string& stem, bool in_place, const std::string& report,
                     const std::string& poses, bool force, std::vector<std::string> others) {
  for (const std::string& file : files_of_map(stem)) others.push_back(file);
  require_apart("--report", report, others);
  others.push_back(report);
  require_apart("--write-poses", poses, others);
  require_map_writable(stem, force || in_place);
  for (const std::string& file : {report, poses}) require_writable(file, force);
}

}  // namespace octosurf
