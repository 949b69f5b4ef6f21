#include "serve/api.hpp"

#include <charconv>
#include <nlohmann/json.hpp>

namespace octosurf {
namespace {

constexpr std::size_t longest_text = 64;

HttpReply json_reply(std::string body) {
  return {200, "application/json", std::make_shared<const std::string>(std::move(body))};
}

[[noreturn]] void refuse(const std::string& parameter, const char* what, const char* hint) {
  throw Error(Error::Kind::usage, parameter.substr(0, longest_text), what, hint);
}

HttpReply changes(const ServedMap& map, const QueryParameters& given) {
  std::optional<std::uint64_t> since;
  std::string run;
  for (const auto& [name, text] : given) {
    if (name != "since" && name != "run") refuse(name, "is no parameter of changes", "it has since, run");
    if (given.count(name) > 1) refuse(name, "is given twice", "give it once");
    if (name == "run") {
      run = text;
      continue;
    }
    std::uint64_t revision = 0;
    const auto [behind, failure] = std::from_chars(text.data(), text.data() + text.size(), revision);
    if (failure != std::errc() || behind != text.data() + text.size())
      refuse(name, "is no revision", "give one of an earlier answer");
    since = revision;
  }
  return json_reply(map.changes_json(since, run) + "\n");
}

}  // namespace

HttpReply refusal(int status, const std::string& what, const std::string& where, const std::string& hint) {
  const nlohmann::ordered_json json{{"error", what}, {"where", where}, {"hint", hint}};
  HttpReply reply = json_reply(json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
  reply.status = status;
  return reply;
}

HttpReply refusal(int status, const Error& error, const std::string& where) {
  // what() is "where: what; hint", with parts that are empty left out.
  std::string what = error.what();
  if (!error.where().empty()) what.erase(0, error.where().size() + 2);
  if (!error.hint().empty()) what.erase(what.size() - error.hint().size() - 2);
  return refusal(status, what, where, error.hint());
}

HttpReply answer_to(const ServedMap& map, const std::string& path, const QueryParameters& given) {
  if (path == "/") return {200, "text/html; charset=utf-8", map.page_html()};
  if (path == "/api/voxels") return {200, "application/octet-stream", map.voxels()};
  if (path == "/api/changes") return changes(map, given);
  return refusal(404, "there is no such page", path.substr(0, longest_text), "see octosurf serve --help");
}

}  // namespace octosurf
