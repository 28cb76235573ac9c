// SPDX-License-Identifier: Apache-2.0
// view_door.h - whom the view's server lets in, by the head of a request that is not trusted.
#pragma once
#include <string>
#include <string_view>

namespace h6::io::view {

// The secret and the port that a request must name. Only the printed address has the token.
struct Door {
  std::string token;  // an empty one opens nothing
  std::string port;   // decimal
};

// The head of a request, as far as it matters here.
struct Knock {
  std::string_view target, host, origin;
  bool reads = false;    // its method is GET or HEAD
  bool upgrade = false;  // it asks for a WebSocket
};

struct Answer {
  unsigned status = 0;       // of HTTP; 200: send the page, 101: become a WebSocket
  std::string_view refusal;  // a sentence for every other status
};

Answer answer_to(const Knock& knock, const Door& door);

// The value of the first `token` in "/path?a=b&token=T"; empty when there is none.
std::string_view token_of(std::string_view target);

}  // namespace h6::io::view
