// SPDX-License-Identifier: Apache-2.0
#include "io/view/view_door.h"

#include <algorithm>

namespace h6::io::view {
namespace {

// Takes the same time for wrong and right guesses, so the time tells nothing about the token.
bool same(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  unsigned char differ = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    differ = static_cast<unsigned char>(differ | (a[i] ^ b[i]));
  return differ == 0;
}

bool known_host(std::string_view host, const Door& door) {
  return host == "127.0.0.1:" + door.port || host == "localhost:" + door.port;
}
bool known_origin(std::string_view origin, const Door& door) {
  return origin.substr(0, 7) == "http://" && known_host(origin.substr(7), door);
}

}  // namespace

std::string_view token_of(std::string_view target) {
  const auto query = target.find('?');
  if (query == std::string_view::npos) return {};
  std::string_view rest = target.substr(query + 1);
  while (!rest.empty()) {
    const std::string_view part = rest.substr(0, rest.find('&'));
    if (part.substr(0, 6) == "token=") return part.substr(6);
    rest.remove_prefix(std::min(rest.size(), part.size() + 1));
  }
  return {};
}

Answer answer_to(const Knock& knock, const Door& door) {
  const std::string_view path = knock.target.substr(0, knock.target.find('?'));
  if (!known_host(knock.host, door)) return {403, "not this host"};
  if (path != "/" && path != "/live") return {404, "there is only one page here"};
  if (door.token.empty() || !same(token_of(knock.target), door.token))
    return {403, "the token is missing: open the whole address that hapsix printed"};
  if (path == "/live") {
    if (!knock.upgrade) return {426, "this address is for a WebSocket"};
    if (!known_origin(knock.origin, door)) return {403, "not from this page"};
    return {101, {}};
  }
  if (!knock.reads) return {405, "only GET is supported"};
  return {200, {}};
}

}  // namespace h6::io::view
