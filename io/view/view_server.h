// SPDX-License-Identifier: Apache-2.0
// view_server.h - a web server for one page and its live data, for the user of this machine only.
//
//   GET /?token=T             the page
//   GET /live?token=T         WebSocket: binary messages out (envelope.h), short texts in
//
// It listens on 127.0.0.1. Other programs and other sites' scripts are refused: every request must
// carry the token, which only the printed address has; the Host header must be this address, so a
// foreign name that resolves here fails; a WebSocket must come from this page's Origin. A client
// that answers each live message it has drawn with the text "seen" gets the next when it has drawn
// all but one; a client too slow for the live messages misses some. A client that stops reading or sends too long a text
// is closed; the others do not notice. Where too many connections wait with half a request, the one
// that waits longest gives way to the next. The server works on its own thread, so a caller that
// publishes never waits for a client.
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
  std::uint16_t port = 0;            // 0: any free port
  std::size_t max_clients = 8;       // at once, watching
  std::size_t max_connections = 32;  // at once, in all
  std::size_t max_request = 4096;    // longest text from a client [bytes]
  int stall_seconds = 20;            // a client that does not read for this long is closed
  std::string token;                 // empty: 128 random bits
};

class ViewServer {
 public:
  // Called on the server's thread with a text from a client. Text that is not UTF-8 closes the
  // client instead.
  using Receive = std::function<void(std::string_view text)>;

  // `page` is sent as HTML. Fails when the port is taken.
  static Result<std::unique_ptr<ViewServer>> open(const ServerOptions& options, std::string page,
                                                  Receive receive);
  ~ViewServer();  // closes every client

  std::string address() const;  // http://127.0.0.1:PORT/?token=T
  // Sets the first message that each new client gets.
  void greet(Message message);
  // Sends to every client; replaces the last live message where a client has not taken it yet.
  void publish(Message live);
  // Sends to every client, in order and without gaps; a client with 64 outstanding is closed.
  void say(Message message);

  std::size_t clients() const;    // that watch now
  // Whether a client waits for a live message. What is published otherwise reaches nobody yet.
  bool ready() const;
  std::uint64_t refused() const;  // requests turned away

 private:
  struct Body;
  explicit ViewServer(std::unique_ptr<Body> body);
  std::unique_ptr<Body> body_;
};

}  // namespace h6::io::view
