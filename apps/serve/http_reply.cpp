#include "serve/http_reply.hpp"

#include <nlohmann/json.hpp>
#include <utility>

namespace octosurf {

HttpReply reply_of(std::string body) {
  return {200, "application/json", std::make_shared<const std::string>(std::move(body))};
}

HttpReply refusal(int status, const std::string& what, const std::string& where, const std::string& hint) {
  using Json = nlohmann::ordered_json;
  const Json json{{"error", what}, {"where", where}, {"hint", hint}};
  HttpReply reply = reply_of(json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n");
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

}  // namespace octosurf
