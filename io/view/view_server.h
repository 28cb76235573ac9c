// SPDX-License-Identifier: Apache-2.0
// view_server.h - a web server for one page and its live data, for the person at this machine only.
//
//   GET /?token=T             the page
//   GET /live?token=T         WebSocket: binary messages out (envelope.h), short texts in
//
// It listens on 127.0.0.1. Another program or another site's script cannot get in: every request
// must carry the token that only the printed address has, the Host header must be this address
// (a foreign name that resolves here is refused), and a WebSocket must come from this page's
// Origin. A client that is too slow for live messages misses some, one that does not read at all,
// or sends what is too long, is closed; nobody else notices. All of it is on the server's own
// thread: whoever publishes never waits for a client.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "hapsix/result.h"
#include "io/view/envelope.h"

namespace h6::io::view {

struct ServerOptions {
  std::uint16_t port = 0;            // 0: any free one
  std::size_t max_clients = 8;       // at once, watching
  std::size_t max_connections = 32;  // at once, in all
  std::size_t max_request = 4096;    // of a text from a client [bytes]
  int stall_seconds = 20;            // a client that does not read for so long is closed
  std::string token;                 // empty: 128 random bits
};

class ViewServer {
 public:
  // A text from a client, on the server's thread. Texts that are no UTF-8 close the client before.
  using Receive = std::function<void(std::string_view text)>;

  // `page` is sent as HTML. Fails when the port is taken.
  static Result<std::unique_ptr<ViewServer>> open(const ServerOptions& options, std::string page,
                                                  Receive receive);
  ~ViewServer();  // closes every client

  std::string address() const;  // http://127.0.0.1:PORT/?token=T
  // The first message that each client gets, now and later.
  void greet(Message message);
  // To every client. A live message that a client has not taken yet is replaced by the next one.
  void publish(Message live);
  // To every client, in order, none left out: a client with 64 of them outstanding is closed.
  void say(Message message);

  std::size_t clients() const;    // watching now
  std::uint64_t refused() const;  // requests turned away

 private:
  struct Body;
  explicit ViewServer(std::unique_ptr<Body> body);
  std::unique_ptr<Body> body_;
};

}  // namespace h6::io::view
