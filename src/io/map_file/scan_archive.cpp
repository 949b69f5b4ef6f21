#include "io/map_file/scan_archive.hpp"

#include "io/new_file.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view scan_ending = ".scan";
constexpr std::size_t fewest_digits = 6, most_digits = 15;

/// The number in an archived file's name.
std::optional<std::uint64_t> archived_number(const fs::path& file) {
  const std::string name = file.filename().string();
  if (!name.ends_with(scan_ending)) return {};
  const std::string digits = name.substr(0, name.size() - scan_ending.size());
  if (digits.size() < fewest_digits || digits.size() > most_digits ||
      !std::all_of(digits.begin(), digits.end(), [](char c) { return c >= '0' && c <= '9'; }))
    return {};
  return std::stoull(digits);
}

[[noreturn]] void fail_writing(const fs::path& where, const char* what, const std::error_code& failure) {
  throw Error(Error::Kind::output, where.string(), what + (": " + failure.message()),
              "check the folder, its rights and the space left");
}

/// What of the archive in `folder` has `first` or a higher number.
std::vector<fs::path> files_from(const fs::path& folder, std::uint64_t first) {
  std::vector<fs::path> files;
  std::error_code failure;
  fs::directory_iterator entry(folder, failure);
  for (; !failure && entry != fs::directory_iterator(); entry.increment(failure))
    if (const auto number = archived_number(entry->path()); number && *number >= first)
      files.push_back(entry->path());
  if (failure) fail_writing(folder, "cannot be looked at", failure);
  return files;
}

void make_folder(const fs::path& folder) {
  std::error_code failure;
  fs::create_directories(folder, failure);
  if (failure) fail_writing(folder, "cannot be made", failure);
}

}  // namespace

fs::path archived_file(const fs::path& folder, std::uint64_t number) {
  std::array<char, 32> name{};
  std::snprintf(name.data(), name.size(), "%06llu.scan", static_cast<unsigned long long>(number));
  return folder / name.data();
}

std::vector<fs::path> archived_files(const fs::path& folder, std::uint64_t scans) {
  std::vector<fs::path> files;
  for (std::uint64_t i = 0; i < scans; ++i) {
    files.push_back(archived_file(folder, i));
    std::error_code ignored;
    if (!fs::is_regular_file(files.back(), ignored))
      throw Error(
          Error::Kind::data, files.back().string(),
          "is missing: the map has " + std::to_string(scans) + " scans, and the archive not all of them",
          "name the map's own archive");
  }
  return files;
}

void require_room_for_archive(const fs::path& folder, bool force) {
  std::error_code ignored;
  const fs::file_status there = fs::status(folder, ignored);
  if (!fs::exists(there)) return;
  if (!fs::is_directory(there))
    throw Error(Error::Kind::output, folder.string(), "is not a folder", "name a folder for the scans");
  const auto is_archived = [](const fs::directory_entry& entry) {
    return archived_number(entry.path()).has_value();
  };
  const fs::directory_iterator begin(folder, ignored), end;
  if (begin == end) return;
  if (!std::all_of(fs::directory_iterator(folder, ignored), end, is_archived))
    throw Error(Error::Kind::usage, folder.string(), "holds other things than archived scans",
                "name a folder of their own for the scans");
  if (!force)
    throw Error(Error::Kind::usage, folder.string(), "holds archived scans already",
                "--force replaces them, --resume goes on with their map");
}

ScanArchiveWriter::ScanArchiveWriter(fs::path folder, std::uint64_t scans)
    : folder_(std::move(folder)), next_(scans) {
  make_folder(folder_);
  archived_files(folder_, scans);
  for (const fs::path& file : files_from(folder_, scans)) {
    std::error_code failure;
    fs::remove(file, failure);
    if (failure) fail_writing(file, "cannot be replaced", failure);
  }
}

ScanArchiveWriter::~ScanArchiveWriter() {
  if (writing_.valid()) writing_.wait();
}

void ScanArchiveWriter::add(ArchivedHeader header, sensing::VoxelScan voxels) {
  if (writing_.valid()) writing_.get();
  const auto write = [file = archived_file(folder_, next_++), header = std::move(header),
                      voxels = std::move(voxels)]() mutable {
    const ArchivedScan scan = archived(std::move(header), voxels);
    NewFile out(file, true, NewFile::LeftOvers::leave);
    out.write([&](std::ostream& stream) { write_archived_scan(scan, stream); });
    out.commit();
  };
  try {
    writing_ = std::async(std::launch::async, write);
  } catch (const std::system_error&) {  // no thread to be had: written when it is waited for
    writing_ = std::async(std::launch::deferred, write);
  }
}

void ScanArchiveWriter::finish() {
  if (!writing_.valid()) return;
  writing_.get();
  sync_folder(archived_file(folder_, 0));
}

void copy_archive(const fs::path& from, const fs::path& folder, std::uint64_t scans) {
  make_folder(folder);
  const std::vector<fs::path> files = archived_files(from, scans);
  for (std::uint64_t i = 0; i < scans; ++i) {
    const fs::path to = archived_file(folder, i);
    std::error_code failure;
    fs::remove(to, failure);
    fs::create_hard_link(files[i], to, failure);
    if (failure) fs::copy_file(files[i], to, failure);
    if (failure) fail_writing(to, "cannot be made", failure);
  }
}

}  // namespace octosurf::io
