#include "serve/http_guard.hpp"

#include <algorithm>
#include <arpa/inet.h>
#include <cctype>
#include <string_view>

namespace octosurf {
namespace {

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

/// The password of "Basic base64(user:password)"; empty if it is none.
std::string password_in(std::string_view base64) {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  unsigned bits = 0, count = 0;
  for (const char c : base64) {
    const std::size_t digit = digits.find(c);
    if (digit == std::string_view::npos) break;  // padding
    bits = (bits << 6 | static_cast<unsigned>(digit)) & 0xffff;
    count += 6;
    if (count < 8) continue;
    count -= 8;
    text += static_cast<char>(bits >> count & 0xff);
  }
  const std::size_t colon = text.find(':');
  return colon == std::string::npos ? std::string() : text.substr(colon + 1);
}

/// The name in a Host field, without its port and brackets.
std::string host_name(const std::string& host) {
  if (host.starts_with('[')) return host.substr(1, host.find(']') - 1);
  return lower(host.substr(0, host.find(':')));
}

bool same_in_constant_time(const std::string& given, const std::string& expected) {
  // Volatile, so that no compiler ends the loop at the first difference. As many rounds as `given` is long,
  // which its sender knows already.
  volatile unsigned difference = given.size() == expected.size() ? 0 : 1;
  for (std::size_t i = 0; i < given.size(); ++i)
    difference = difference | static_cast<unsigned>(given[i] ^ expected[i % (expected.size() + 1)]);
  return difference == 0;
}

bool has_token(const std::string& authorization, const std::string& token) {
  const std::size_t blank = authorization.find(' ');
  if (blank == std::string::npos) return false;
  const std::string scheme = lower(authorization.substr(0, blank)), rest = authorization.substr(blank + 1);
  if (scheme == "bearer") return same_in_constant_time(rest, token);
  return scheme == "basic" && same_in_constant_time(password_in(rest), token);
}

}  // namespace

bool is_loopback(const std::string& address) {
  in_addr v4{};
  in6_addr v6{};
  if (::inet_pton(AF_INET, address.c_str(), &v4) == 1) return (ntohl(v4.s_addr) >> 24) == 127;
  return ::inet_pton(AF_INET6, address.c_str(), &v6) == 1 && IN6_IS_ADDR_LOOPBACK(&v6) != 0;
}

std::optional<HttpReply> guard(const HttpPlace& place, const std::optional<std::string>& host,
                               const std::optional<std::string>& origin,
                               const std::optional<std::string>& authorization) {
  if (!host) return refusal(400, "the request names no host", "Host", "send HTTP/1.1 with a Host field");
  if (is_loopback(place.address)) {
    const std::string name = host_name(*host);
    if (name != "localhost" && !is_loopback(name))
      return refusal(421, "this server is of this machine alone, not '" + name + "'", "Host",
                     "use 127.0.0.1 or localhost");
  }
  if (origin && *origin != "http://" + *host && *origin != "https://" + *host)
    return refusal(403, "another site's page has no access", "Origin", "use this server's page");
  if (!place.token.empty() && !(authorization && has_token(*authorization, place.token)))
    return refusal(401, "the token is missing or wrong", "Authorization",
                   "send 'Authorization: Bearer TOKEN', or the token as the password");
  return std::nullopt;
}

}  // namespace octosurf
