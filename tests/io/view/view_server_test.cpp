// SPDX-License-Identifier: Apache-2.0
// The view's server as clients see it: whom it admits, whom it closes, and that nobody waits.
#include <doctest/doctest.h>

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <memory>
#include <mutex>
#include <random>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "io/view/view_server.h"

using namespace h6::io::view;

namespace {

bool soon(const std::function<bool()>& what, double seconds = 20) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (!what()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

// A raw socket, so that a test can send malformed requests.
struct Line {
  int fd = -1;
  explicit Line(int port, int receive_buffer = 0) {
    fd = socket(AF_INET, SOCK_STREAM, 0);
    if (receive_buffer)
      setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    REQUIRE(connect(fd, reinterpret_cast<sockaddr*>(&to), sizeof to) == 0);
  }
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;
  ~Line() { close(fd); }

  void send(const std::string& text) const {
    std::size_t done = 0;
    while (done < text.size()) {
      const ssize_t n = ::send(fd, text.data() + done, text.size() - done, MSG_NOSIGNAL);
      if (n <= 0) return;  // the server closed the connection
      done += static_cast<std::size_t>(n);
    }
  }
  // The bytes that arrive until so many ms of silence, at most `most`; `closed` when the server
  // closed the connection.
  std::string read(int ms, bool* closed = nullptr, std::size_t most = 1 << 22) const {
    std::string all;
    char buffer[65536];
    while (all.size() < most) {
      pollfd p{fd, POLLIN, 0};
      if (poll(&p, 1, ms) <= 0) return all;
      const ssize_t n = recv(fd, buffer, sizeof buffer, 0);
      if (n <= 0) {
        if (closed) *closed = true;
        return all;
      }
      all.append(buffer, static_cast<std::size_t>(n));
    }
    return all;
  }
};

// One masked frame of a client (RFC 6455, Sec. 5.2). Without `claim` only short frames.
std::string frame(const std::string& text, int opcode = 1, std::uint64_t claim = 0) {
  const std::uint64_t size = claim ? claim : text.size();
  std::string out(1, static_cast<char>(0x80 | opcode));
  if (size < 126) {
    out += static_cast<char>(0x80 | size);
  } else if (size < 65536) {
    out += static_cast<char>(0x80 | 126);
    for (int shift = 8; shift >= 0; shift -= 8) out += static_cast<char>(size >> shift & 255);
  } else {
    out += static_cast<char>(0x80 | 127);
    for (int shift = 56; shift >= 0; shift -= 8) out += static_cast<char>(size >> shift & 255);
  }
  const char mask[4] = {0x11, 0x22, 0x33, 0x44};
  out.append(mask, 4);
  for (std::size_t i = 0; i < text.size(); ++i) out += static_cast<char>(text[i] ^ mask[i & 3]);
  return out;
}

struct Server {
  std::mutex mutex;
  std::vector<std::string> heard;
  std::unique_ptr<ViewServer> server;
  int port = 0;
  std::string token = "0123456789abcdef";

  explicit Server(ServerOptions options = {}) {
    options.token = token;
    auto opened = ViewServer::open(options, "<html>the page</html>", [this](std::string_view text) {
      const std::lock_guard<std::mutex> lock(mutex);
      heard.emplace_back(text);
    });
    REQUIRE(opened);
    server = std::move(*opened);
    const std::string address = server->address();
    port = std::stoi(address.substr(address.rfind(':') + 1));
  }
  std::string host() const { return "127.0.0.1:" + std::to_string(port); }
  std::size_t heard_count() {
    const std::lock_guard<std::mutex> lock(mutex);
    return heard.size();
  }
  std::string get(const std::string& target, const std::string& host_header) const {
    const Line line(port);
    line.send("GET " + target + " HTTP/1.1\r\nHost: " + host_header + "\r\n\r\n");
    return line.read(2000);
  }
  std::string upgrade(const std::string& target, const std::string& origin) const {
    return "GET " + target + " HTTP/1.1\r\nHost: " + host() +
           "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
           "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n" +
           (origin.empty() ? "" : "Origin: " + origin + "\r\n") + "\r\n";
  }
};

// A connected page.
struct Client : Line {
  explicit Client(const Server& s, int receive_buffer = 0) : Line(s.port, receive_buffer) {
    send(s.upgrade("/live?token=" + s.token, "http://" + s.host()));
    std::string answer;  // exactly up to its empty line
    for (char c; answer.find("\r\n\r\n") == std::string::npos && recv(fd, &c, 1, 0) == 1;)
      answer += c;
    REQUIRE(answer.rfind("HTTP/1.1 101", 0) == 0);
  }
};

int status(const std::string& reply) {
  return reply.size() > 12 ? std::atoi(reply.c_str() + 9) : 0;
}

}  // namespace

TEST_CASE("the page is served only with the token and at this address") {
  const Server s;
  const std::string page = s.get("/?token=" + s.token, s.host());
  CHECK(status(page) == 200);
  CHECK(page.find("the page") != std::string::npos);
  CHECK(page.find("Content-Security-Policy") != std::string::npos);
  CHECK(status(s.get("/?token=" + s.token, "localhost:" + std::to_string(s.port))) == 200);
  for (const std::string& target :
       std::vector<std::string>{"/", "/?token=", "/?token=0123456789abcdee", "/?other=" + s.token,
                                "/?token=" + s.token + "0"}) {
    const std::string reply = s.get(target, s.host());
    CHECK_MESSAGE(status(reply) == 403, target);
    CHECK(reply.find("the page") == std::string::npos);
  }
  // A foreign name that resolves to this address (DNS rebinding).
  CHECK(status(s.get("/?token=" + s.token, "evil.example:" + std::to_string(s.port))) == 403);
  CHECK(status(s.get("/?token=" + s.token, "127.0.0.1:1")) == 403);
  CHECK(status(s.get("/etc/passwd?token=" + s.token, s.host())) == 404);
  CHECK(s.server->refused() == 8);
}

TEST_CASE("only this machine can connect") {
  const Server s;
  CHECK(s.server->address().rfind("http://127.0.0.1:", 0) == 0);
  // The server does not listen on other addresses of this machine, such as 127.0.0.2.
  const int fd = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(s.port));
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK + 1);
  CHECK(connect(fd, reinterpret_cast<sockaddr*>(&to), sizeof to) != 0);
  close(fd);
}

TEST_CASE("a WebSocket must come from this page and bring the token") {
  const Server s;
  const auto tried = [&](const std::string& target, const std::string& origin) {
    const Line line(s.port);
    line.send(s.upgrade(target, origin));
    return status(line.read(500, nullptr, 64));
  };
  const std::string live = "/live?token=" + s.token, here = "http://" + s.host();
  CHECK(tried(live, here) == 101);
  CHECK(tried(live, "") == 403);
  CHECK(tried(live, "http://evil.example") == 403);
  CHECK(tried(live, "https://" + s.host()) == 403);
  CHECK(tried(live, here + ".evil.example") == 403);
  CHECK(tried("/live", here) == 403);
  CHECK(tried("/live?token=wrong", here) == 403);
}

TEST_CASE("texts reach the program, messages reach the client, and the greeting comes first") {
  Server s;
  s.server->greet(std::make_shared<const std::string>("hello"));
  const Client client(s);
  client.send(frame("{\"do\":\"reset\"}"));
  REQUIRE(soon([&] { return s.heard_count() == 1; }));
  CHECK(s.heard[0] == "{\"do\":\"reset\"}");
  s.server->publish(std::make_shared<const std::string>("live one"));
  const std::string got = client.read(500);
  CHECK(got.find("hello") < got.find("live one"));
  CHECK(got.find("live one") != std::string::npos);
}

TEST_CASE("a page that says what it has seen gets two messages ahead, and the newest after that") {
  Server s;
  const Client client(s);
  REQUIRE(soon([&] { return s.server->clients() == 1; }));
  client.send(frame("seen"));
  client.send(frame("{}"));  // both are heard in their order
  REQUIRE(soon([&] { return s.heard_count() == 1; }));
  CHECK(s.heard[0] == "{}");
  for (const char* live : {"live 1", "live 2"}) {
    REQUIRE(soon([&] { return s.server->ready(); }));
    s.server->publish(std::make_shared<const std::string>(live));
  }
  CHECK(client.read(100).find("live 2") != std::string::npos);
  CHECK(!s.server->ready());
  s.server->publish(std::make_shared<const std::string>("live 3"));
  s.server->publish(std::make_shared<const std::string>("live 4"));
  CHECK(client.read(100).empty());
  client.send(frame("seen"));
  const std::string got = client.read(500);
  CHECK(got.find("live 3") == std::string::npos);
  CHECK(got.find("live 4") != std::string::npos);
  // One that sees nothing for a second, in the background, is sent the next all the same.
  s.server->publish(std::make_shared<const std::string>("live 5"));
  s.server->publish(std::make_shared<const std::string>("live 6"));
  std::this_thread::sleep_for(std::chrono::milliseconds(1200));
  s.server->publish(std::make_shared<const std::string>("live 7"));
  CHECK(client.read(500).find("live 7") != std::string::npos);
}

TEST_CASE("oversize and malformed messages close that client only") {
  ServerOptions options;
  options.stall_seconds = 600;  // so that only the cause under test closes a client
  Server s(options);
  const Client good(s);
  const std::string huge(5000, 'x');
  for (const std::string& wrong :
       {frame(huge), frame("", 1, std::uint64_t{1} << 62), frame("binary", 2), frame("\xff\xfe"),
        frame("ping too long" + std::string(120, 'p'), 9), std::string(20, '\xff'),
        frame("reserved", 5), std::string("\x01\x05hello", 7)}) {
    {
      const Client bad(s);
      bad.send(wrong);
      bool closed = false;
      (void)bad.read(10000, &closed);
      CHECK(closed);
    }
    CHECK(soon([&] { return s.server->clients() == 1; }));
  }
  good.send(frame("still here"));
  REQUIRE(soon([&] { return s.heard_count() >= 1; }));
  CHECK(s.heard.back() == "still here");
}

TEST_CASE(
    "a client that does not read delays nobody, misses live messages, and is closed when told "
    "too much") {
  ServerOptions options;
  options.stall_seconds = 600;  // so that only the cause under test closes a client
  Server s(options);
  const Client stalled(s, 4096), reader(s);
  const auto live = std::make_shared<const std::string>(std::string(100000, 'L'));
  std::size_t read = 0;
  for (int i = 0; i < 200; ++i) {
    s.server->publish(live);
    read += reader.read(5).size();
  }
  read += reader.read(300).size();
  CHECK(read > 1000000);  // the client that reads still got its messages
  CHECK(soon([&] { return s.server->clients() == 2; }));  // the other one has no backlog
  for (int i = 0; i < 200; ++i) s.server->say(live);
  CHECK(soon([&] {
    (void)reader.read(5);
    return s.server->clients() <= 1;
  }));
}

TEST_CASE("a client that is killed is forgotten") {
  Server s;
  {
    const Client killed(s);
    linger at_once{1, 0};  // close() then sends a reset
    setsockopt(killed.fd, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
  }
  const auto live = std::make_shared<const std::string>(std::string(1000, 'L'));
  CHECK(soon([&] {
    s.server->publish(live);
    return s.server->clients() == 0;
  }));
}

TEST_CASE("a silent client is closed after the stall time") {
  ServerOptions options;
  options.stall_seconds = 1;
  Server s(options);
  const Client silent(s);  // it does not answer the server's pings either
  CHECK(soon([&] { return s.server->clients() == 0; }));
}

TEST_CASE("clients and connections beyond the limits are refused") {
  ServerOptions options;
  options.max_clients = 2;
  options.max_connections = 6;
  Server s(options);
  const Client a(s), b(s);
  const Line third(s.port);
  third.send(s.upgrade("/live?token=" + s.token, "http://" + s.host()));
  CHECK(status(third.read(1000, nullptr, 64)) == 503);
  // A silent connection gives its place to the next.
  std::vector<std::unique_ptr<Line>> idle;
  for (int i = 0; i < 40; ++i) idle.push_back(std::make_unique<Line>(s.port));
  CHECK(soon([&] { return s.server->refused() > 20; }));
  CHECK(s.server->clients() == 2);
}

TEST_CASE("silent connections, and half requests, do not keep the page from its user") {
  const Server s;  // it takes 32 connections
  std::vector<std::unique_ptr<Line>> idle;
  for (int i = 0; i < 100; ++i) {
    idle.push_back(std::make_unique<Line>(s.port));
    if (i % 2) idle.back()->send("GET / HTTP/1.1\r\nHost: ");
  }
  CHECK(soon([&] { return s.server->refused() >= 68; }));
  for (int i = 0; i < 20; ++i) CHECK(status(s.get("/?token=" + s.token, s.host())) == 200);
  const Client page(s);
  CHECK(soon([&] { return s.server->clients() == 1; }));
}

TEST_CASE("a port in use gives one sentence") {
  const Server s;
  ServerOptions options;
  options.port = static_cast<std::uint16_t>(s.port);
  const auto second = ViewServer::open(options, "", [](std::string_view) {});
  REQUIRE(!second);
  CHECK(second.error().find("choose another port") != std::string::npos);
}

TEST_CASE("1e5 random requests and frames: no crash, and the page is still served") {
  Server s;
  std::mt19937 random(7);
  const auto junk = [&](std::size_t n) {
    std::string text(n, '\0');
    for (char& c : text) c = static_cast<char>(random());
    return text;
  };
  const std::string pieces[] = {"GET ",
                                "/live?token=",
                                s.token,
                                " HTTP/1.1\r\n",
                                "Host: ",
                                s.host(),
                                "\r\n",
                                "Origin: ",
                                "Content-Length: 99999999999\r\n",
                                "\r\n\r\n",
                                "Transfer-Encoding: chunked\r\n",
                                "{\"do\":",
                                std::string(3, '\0')};
  std::size_t sent = 0;
  while (sent < 20000) {  // pieces of requests, on many connections
    const Line line(s.port);
    std::string text;
    for (int i = 0; i < 100; ++i, ++sent)
      text += random() % 4 ? pieces[random() % std::size(pieces)] : junk(random() % 40);
    line.send(text);
  }
  while (sent < 100000) {  // frames, until the server closes the client
    const Client client(s);
    for (int i = 0; i < 400; ++i, ++sent) {
      std::string f = frame(junk(random() % 100), static_cast<int>(random() % 3));
      if (random() % 50 == 0) f[random() % f.size()] ^= static_cast<char>(1 << random() % 8);
      client.send(f);
    }
  }
  CHECK(status(s.get("/?token=" + s.token, s.host())) == 200);
}
