// SPDX-License-Identifier: Apache-2.0
#include "io/view/view_server.h"

#include <algorithm>
#include <atomic>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <cstdio>
#include <deque>
#include <list>
#include <optional>
#include <random>
#include <set>
#include <thread>

#include "io/view/view_door.h"

namespace h6::io::view {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = asio::ip::tcp;
using beast::error_code;

constexpr std::size_t kOutstanding = 64;
constexpr auto kRequestTime = std::chrono::seconds(10);
// Of live messages that a client has not seen yet. Two: one is drawn while the next is on its way.
constexpr int kUnseen = 2;
// A page in the background does not draw, and sees nothing; it gets a message now and then.
constexpr auto kPatience = std::chrono::seconds(1);

std::string random_token() {
  std::random_device random;
  char text[33];
  std::snprintf(text, sizeof text, "%08x%08x%08x%08x", random(), random(), random(), random());
  return text;
}

std::string_view view_of(beast::string_view s) { return {s.data(), s.size()}; }

}  // namespace

struct ViewServer::Body {
  class Client;
  class Connection;

  ServerOptions options;
  Door door;
  std::string page;
  Receive receive;
  // These two are declared before io: io's destructor runs handlers that change them.
  std::size_t connections = 0;
  std::list<Connection*> silent;  // their requests are not whole yet; the oldest comes first
  asio::io_context io{1};
  tcp::acceptor acceptor{io};
  Message greeting;
  std::set<std::shared_ptr<Client>> watching;
  std::atomic<std::size_t> client_count{0};
  std::atomic<std::uint64_t> refused_count{0};
  std::atomic<bool> any_ready{false};
  std::thread thread;

  void accept();
  void count_ready();
};

// An open page: one message is being sent, the newest live message waits behind it.
class ViewServer::Body::Client : public std::enable_shared_from_this<Client> {
 public:
  Client(Body& body, tcp::socket socket) : body_(body), stream_(std::move(socket)) {}

  void start(const http::request<http::empty_body>& request) {
    websocket::stream_base::timeout limits{};
    limits.handshake_timeout = kRequestTime;
    limits.idle_timeout = std::chrono::seconds(body_.options.stall_seconds);
    limits.keep_alive_pings = true;
    stream_.set_option(limits);
    stream_.read_message_max(body_.options.max_request);
    stream_.binary(true);
    stream_.async_accept(request, [self = shared_from_this()](error_code failed) {
      if (failed) return self->end();
      self->open_ = true;
      self->body_.watching.insert(self);
      self->body_.client_count = self->body_.watching.size();
      if (self->body_.greeting) self->say(self->body_.greeting);
      self->body_.count_ready();
      self->read();
    });
  }
  void say(const Message& message) {
    if (!open_) return;
    if (queue_.size() >= kOutstanding) return end();
    queue_.push_back(message);
    write();
  }
  void live(const Message& message) {
    if (!open_) return;
    live_ = message;
    write();
  }
  bool ready() const { return open_ && !live_ && may_send(); }
  void end() {
    open_ = false;
    error_code ignored;
    stream_.next_layer().socket().close(ignored);
    if (body_.watching.erase(shared_from_this())) body_.client_count = body_.watching.size();
    body_.count_ready();
  }

 private:
  void read() {
    stream_.async_read(buffer_, [self = shared_from_this()](error_code failed, std::size_t) {
      if (failed) return self->end();  // closed, too long, or not a WebSocket's frame
      if (!self->stream_.got_text()) return self->end();
      const auto data = self->buffer_.cdata();
      self->heard({static_cast<const char*>(data.data()), data.size()});
      self->buffer_.consume(self->buffer_.size());
      self->read();
    });
  }
  void heard(std::string_view text) {
    if (text != "seen") return body_.receive(text);
    unseen_ = 0;
    paced_ = true;
    write();
    body_.count_ready();
  }
  bool may_send() const {
    return !paced_ || unseen_ < kUnseen || std::chrono::steady_clock::now() - sent_at_ > kPatience;
  }
  void write() {
    if (sending_) return;
    if (!queue_.empty()) {
      sending_ = queue_.front();
      queue_.pop_front();
    } else if (live_ && may_send()) {
      sending_.swap(live_);
      ++unseen_;
      sent_at_ = std::chrono::steady_clock::now();
    }
    if (!sending_) return;
    stream_.async_write(asio::buffer(*sending_),
                        [self = shared_from_this()](error_code failed, std::size_t) {
                          self->sending_.reset();
                          if (failed) return self->end();
                          self->write();
                          self->body_.count_ready();
                        });
  }

  Body& body_;
  websocket::stream<beast::tcp_stream> stream_;
  beast::flat_buffer buffer_;
  std::deque<Message> queue_;
  Message live_, sending_;
  bool open_ = false, paced_ = false;                // paced: it says what it has seen
  int unseen_ = 0;                                   // live messages sent since it said so
  std::chrono::steady_clock::time_point sent_at_{};  // of the last live message
};

// One request: it is answered, refused, or becomes a client.
class ViewServer::Body::Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Body& body, tcp::socket socket) : body_(body), stream_(std::move(socket)) {
    ++body_.connections;
    place_ = body_.silent.insert(body_.silent.end(), this);
  }
  ~Connection() {
    heard();
    --body_.connections;
  }

  void start() {
    parser_.emplace();
    parser_->header_limit(8192);
    parser_->body_limit(0);
    stream_.expires_after(kRequestTime);
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](error_code failed, std::size_t) {
                       self->heard();
                       if (!failed) return self->answer();
                       if (failed != http::error::end_of_stream) ++self->body_.refused_count;
                     });
  }
  // Ends the wait for its request: another needs its place.
  void give_way() {
    heard();
    stream_.cancel();
  }

 private:
  void heard() {
    if (place_) body_.silent.erase(*place_);
    place_.reset();
  }
  void answer() {
    const auto& request = parser_->get();
    const bool reads = request.method() == http::verb::get || request.method() == http::verb::head;
    const Answer answer =
        answer_to({view_of(request.target()), view_of(request[http::field::host]),
                   view_of(request[http::field::origin]), reads, websocket::is_upgrade(request)},
                  body_.door);
    if (answer.status != 101) return reply(http::int_to_status(answer.status), answer.refusal);
    if (body_.watching.size() >= body_.options.max_clients)
      return reply(http::status::service_unavailable, "enough clients are watching already");
    stream_.expires_never();
    std::make_shared<Client>(body_, stream_.release_socket())->start(request);
  }

  // Sends the page, or a refusal.
  void reply(http::status status, std::string_view refusal) {
    response_.emplace(status, 11);
    http::response<http::string_body>& r = *response_;
    const bool good = status == http::status::ok;
    if (!good) ++body_.refused_count;
    r.set(http::field::content_type, good ? "text/html; charset=utf-8" : "text/plain");
    r.set(http::field::cache_control, "no-store");
    r.set("X-Content-Type-Options", "nosniff");
    r.set("Referrer-Policy", "no-referrer");  // the address has the token
    r.set("X-Frame-Options", "DENY");
    r.set("Content-Security-Policy",
          "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
          "img-src data: blob:; connect-src 'self' ws://127.0.0.1:" +
              body_.door.port + " ws://localhost:" + body_.door.port + "; frame-ancestors 'none'");
    r.body() = good ? body_.page : std::string(refusal) + "\n";
    r.keep_alive(false);
    r.prepare_payload();
    if (parser_->get().method() == http::verb::head) r.body().clear();
    stream_.expires_after(kRequestTime);
    http::async_write(stream_, r, [self = shared_from_this()](error_code, std::size_t) {
      error_code ignored;
      self->stream_.socket().shutdown(tcp::socket::shutdown_both, ignored);
    });
  }

  Body& body_;
  std::optional<std::list<Connection*>::iterator> place_;  // in `silent`
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_{16384};
  std::optional<http::request_parser<http::empty_body>> parser_;
  std::optional<http::response<http::string_body>> response_;
};

void ViewServer::Body::count_ready() {
  any_ready = std::any_of(watching.begin(), watching.end(),
                          [](const std::shared_ptr<Client>& c) { return c->ready(); });
}

void ViewServer::Body::accept() {
  acceptor.async_accept([this](error_code failed, tcp::socket socket) {
    if (failed == asio::error::operation_aborted) return;
    if (!failed) {
      // A whole request arrives at once from a browser: the longest wait is the least honest one.
      const bool full = connections >= options.max_connections;
      if (full && silent.empty()) {
        ++refused_count;  // the socket closes when it goes out of scope
      } else {
        if (full) silent.front()->give_way();
        std::make_shared<Connection>(*this, std::move(socket))->start();
      }
    }
    accept();
  });
}

ViewServer::ViewServer(std::unique_ptr<Body> body) : body_(std::move(body)) {}

Result<std::unique_ptr<ViewServer>> ViewServer::open(const ServerOptions& options, std::string page,
                                                     Receive receive) {
  auto body = std::make_unique<Body>();
  body->options = options;
  body->door.token = options.token.empty() ? random_token() : options.token;
  body->page = std::move(page);
  body->receive = std::move(receive);
  error_code failed;
  const tcp::endpoint place(asio::ip::address_v4::loopback(), options.port);
  body->acceptor.open(place.protocol(), failed);
  if (!failed) body->acceptor.set_option(tcp::acceptor::reuse_address(true), failed);
  if (!failed) body->acceptor.bind(place, failed);
  if (!failed) body->acceptor.listen(16, failed);
  if (failed)
    return Failure{"the view cannot listen on 127.0.0.1:" + std::to_string(options.port) + " (" +
                   failed.message() + "): choose another port with --port"};
  body->door.port = std::to_string(body->acceptor.local_endpoint().port());
  Body* raw = body.get();
  raw->accept();
  raw->thread = std::thread([raw] { raw->io.run(); });
  return std::unique_ptr<ViewServer>(new ViewServer(std::move(body)));
}

ViewServer::~ViewServer() {
  asio::post(body_->io, [this] {
    error_code ignored;
    body_->acceptor.close(ignored);
    while (!body_->watching.empty()) {
      const auto client = *body_->watching.begin();
      client->end();
    }
    body_->io.stop();
  });
  body_->thread.join();
}

std::string ViewServer::address() const {
  return "http://127.0.0.1:" + body_->door.port + "/?token=" + body_->door.token;
}

void ViewServer::greet(Message message) {
  asio::post(body_->io, [this, message] { body_->greeting = message; });
}
void ViewServer::publish(Message live) {
  asio::post(body_->io, [this, live] {
    const auto clients = body_->watching;  // sending may end a client, which leaves `watching`
    for (const auto& client : clients) client->live(live);
    body_->count_ready();
  });
}
void ViewServer::say(Message message) {
  asio::post(body_->io, [this, message] {
    const auto clients = body_->watching;
    for (const auto& client : clients) client->say(message);
  });
}

std::size_t ViewServer::clients() const { return body_->client_count.load(); }
bool ViewServer::ready() const { return body_->any_ready.load(); }
std::uint64_t ViewServer::refused() const { return body_->refused_count.load(); }

}  // namespace h6::io::view
