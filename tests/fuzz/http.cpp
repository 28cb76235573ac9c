// SPDX-License-Identifier: Apache-2.0
// http.cpp - heads of requests to the view's server, up to its answer. Nothing is sent.
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <cstring>
#include <memory>
#include <optional>

#include "io/view/view_door.h"
#include "tests/fuzz/targets.h"

namespace h6::fuzz {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
using io::view::Answer;
using io::view::answer_to;
using io::view::Door;
using io::view::Knock;

const std::string kToken = "0123456789abcdef";
const Door kDoor{kToken, "47900"};

// Bytes with nothing behind them, so that AddressSanitizer sees who reads on.
class Exact {
 public:
  explicit Exact(std::string_view bytes) : size_(bytes.size()), data_(new char[size_]) {
    std::copy(bytes.begin(), bytes.end(), data_.get());
  }
  std::string_view view() const { return {data_.get(), size_}; }

 private:
  std::size_t size_;
  std::unique_ptr<char[]> data_;
};

bool let_in(const Knock& knock, const Door& door) {
  const Answer answer = answer_to(knock, door);
  const bool in = answer.status == 200 || answer.status == 101;
  promise(in ? answer.refusal.empty() : answer.status >= 400 && answer.status < 500,
          "a request is let in or refused");
  promise(in || !answer.refusal.empty(), "a refusal is a sentence");
  return in;
}

// Said another way than the server says it: a part of the query that is the token.
bool has_token(std::string_view target) {
  const std::string parts = "&" + std::string(target.substr(target.find('?') + 1)) + "&";
  return target.find('?') != target.npos && parts.find("&token=" + kToken + "&") != parts.npos;
}

void check_admitted(const Knock& knock, unsigned status) {
  const std::string address = ":" + kDoor.port;
  promise(has_token(knock.target), "only the token lets in");
  promise(knock.target.substr(0, knock.target.find('?')) == (status == 101 ? "/live" : "/"),
          "there are two addresses");
  promise(knock.host == "127.0.0.1" + address || knock.host == "localhost" + address,
          "only this host is asked");
  promise(status == 200 ? knock.reads : knock.upgrade, "a page is read, a WebSocket is opened");
  promise(status == 200 || knock.origin == "http://127.0.0.1" + address ||
              knock.origin == "http://localhost" + address,
          "a WebSocket comes from this page");
}

// A request that this door lets in is refused at any other door, and with any longer token.
void check_others(Knock knock) {
  for (std::size_t i = 0; i < kToken.size(); ++i) {
    Door other = kDoor;
    other.token[i] = static_cast<char>(other.token[i] ^ 1);
    promise(!let_in(knock, other), "a token that differs in one bit is wrong");
  }
  for (const std::string& token : {std::string(), kToken.substr(1), kToken + "0"})
    promise(!let_in(knock, {token, kDoor.port}), "a shorter or longer token is wrong");
  Knock bare = knock;
  bare.target = knock.target.substr(0, knock.target.find('?'));
  promise(!let_in(bare, kDoor) && !let_in(bare, {{}, kDoor.port}), "no token is a wrong token");
  promise(!let_in(knock, {kToken, "47901"}), "another port is another host");
  const std::string longer = std::string(knock.host) + "0";
  knock.host = longer;
  promise(!let_in(knock, kDoor), "a longer host is another host");
}

void check(const Knock& given) {
  const Exact target(given.target), host(given.host), origin(given.origin);
  const Knock knock{target.view(), host.view(), origin.view(), given.reads, given.upgrade};
  const std::string_view token = io::view::token_of(knock.target), all = knock.target;
  promise(token.empty() || (token.data() >= all.data() &&
                            token.data() + token.size() <= all.data() + all.size()),
          "a token is a part of the target");
  if (!let_in(knock, kDoor)) return;
  check_admitted(knock, answer_to(knock, kDoor).status);
  check_others(knock);
}

std::string_view view_of(beast::string_view s) { return {s.data(), s.size()}; }

// As view_server.cpp reads a request.
void check_head(std::string_view bytes) {
  http::request_parser<http::empty_body> parser;
  parser.header_limit(8192);
  parser.body_limit(0);
  parser.eager(true);
  beast::error_code failed;
  const Exact exact(bytes);
  parser.put(boost::asio::buffer(exact.view().data(), exact.view().size()), failed);
  if (failed || !parser.is_done()) return;
  const auto& request = parser.get();
  check({view_of(request.target()), view_of(request[http::field::host]),
         view_of(request[http::field::origin]),
         request.method() == http::verb::get || request.method() == http::verb::head,
         beast::websocket::is_upgrade(request)});
}

}  // namespace

// The bytes are a request, and also a target, a host and an origin that no HTTP parser has seen.
void take_http(std::string_view bytes) {
  check_head(bytes);
  check({bytes, "localhost:47900", "http://localhost:47900", true, true});
  check({"/live?token=" + kToken, bytes, "http://localhost:47900", true, true});
  check({"/live?token=" + kToken, "localhost:47900", bytes, true, true});
}

}  // namespace h6::fuzz
