// SPDX-License-Identifier: Apache-2.0
// bridge_test.cpp - the bridge for programs in any language: JSON in UDP datagrams, in both ways; lost
// and late datagrams, garbage, silence.
#include <arpa/inet.h>
#include <doctest/doctest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "device/plugin.h"
#include "tests/device/floor.h"

using namespace h6;
using h6::device::PluginDevice;
using h6::test::Floor;
using h6::test::FloorRun;
using nlohmann::json;

namespace {

const std::string library = HAPSIX_PLUGIN_FOLDER "/bridge.so";

int free_port() {
  const int s = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in a{};
  a.sin_family = AF_INET, a.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof a;
  REQUIRE(bind(s, reinterpret_cast<sockaddr*>(&a), sizeof a) == 0);
  getsockname(s, reinterpret_cast<sockaddr*>(&a), &size);
  close(s);
  return ntohs(a.sin_port);
}

// The program at the other end: a datagram a millisecond.
class Program {
 public:
  explicit Program(int port) : socket_(socket(AF_INET, SOCK_DGRAM, 0)) {
    sockaddr_in to{};
    to.sin_family = AF_INET, to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    REQUIRE(connect(socket_, reinterpret_cast<sockaddr*>(&to), sizeof to) == 0);
    thread_ = std::thread([this] { run(); });
  }
  ~Program() {
    ended_ = true;
    thread_.join();
    close(socket_);
  }
  enum class Says { poses, nothing, garbage, half, old };
  std::atomic<Says> says{Says::poses};
  std::atomic<int> every{1};  // sends one of so many
  std::atomic<double> z{0}, force{0};
  std::atomic<int> answers{0};
  std::atomic<long> answered{0};

 private:
  std::string text(long n) const {
    const Says s = says;
    if (s == Says::nothing) return "";
    if (s == Says::garbage) return "\x01\xff{\"p\": [[[[";
    const json whole{{"n", s == Says::old ? 1 : n},
                     {"p", {0.3, 0.1, 0.7 + z.load()}},
                     {"q", {0.6, 0, 0.8, 0}},
                     {"buttons", 2}};
    return s == Says::half ? whole.dump().substr(0, 20) : whole.dump();
  }
  void run() {
    for (long n = 1; !ended_; ++n) {
      const std::string out = n % every ? "" : text(n);
      if (!out.empty()) (void)!send(socket_, out.data(), out.size(), MSG_NOSIGNAL);
      char in[1024];
      for (ssize_t size; (size = recv(socket_, in, sizeof in, MSG_DONTWAIT)) > 0;) {
        const json a = json::parse(in, in + size, nullptr, false);
        if (!a.is_object() || !a.contains("n") || !a.contains("t")) continue;
        answered = a["n"].get<long>();
        force = a["f"][2].get<double>();
        ++answers;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  int socket_;
  std::atomic<bool> ended_{false};
  std::thread thread_;
};

device::PluginFile at(int port) {
  return {library, {{"port", std::to_string(port)}, {"timeout", "300"}}};
}

}  // namespace

TEST_CASE("a program's poses move the part, and each datagram is answered with the wrench") {
  const int port = free_port();
  Program program(port);
  Floor floor;
  auto opened = PluginDevice::open(at(port), floor.body[1].pose, {});
  REQUIRE_MESSAGE(opened, (opened ? "" : opened.error()));
  FloorRun run(floor, (*opened)->device());
  REQUIRE(run.until([](const h6FrameRecord& r) { return r.hand[0].buttons == 2; }));
  CHECK(std::fabs(run.rows.back().hand[0].pose.p.z - 5e-3) < 1e-12);  // at home
  program.z = -0.02;
  REQUIRE(run.force_comes());
  program.every = 3;  // two of three are lost
  for (int i = 0; i < 400 && !(program.force > 0.5); ++i) {
    CHECK(run.force_comes());
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  CHECK(program.force > 0.5);
  CHECK(program.answers > 10);
  run.rows.clear();
  REQUIRE(run.until([&](const h6FrameRecord&) { return run.rows.size() > 300; }));
  for (const h6FrameRecord& r : run.rows) CHECK(!(r.report.status & H6_DEVICE_LOST));
}

TEST_CASE("silence, garbage, halves and old numbers: zero force, lost, armed only by hand") {
  const int port = free_port();
  Program program(port);
  Floor floor;
  auto opened = PluginDevice::open(at(port), floor.body[1].pose, {});
  REQUIRE_MESSAGE(opened, (opened ? "" : opened.error()));
  FloorRun run(floor, (*opened)->device());
  program.z = -0.02;
  using Says = Program::Says;
  for (const Says says : {Says::nothing, Says::garbage, Says::half, Says::old}) {
    CAPTURE(static_cast<int>(says));
    run.check_loss([&] { program.says = says; }, [&] { program.says = Says::poses; });
  }
}

TEST_CASE("a program that ends is a lost device, and one that is started again counts from 1") {
  const int port = free_port();
  auto program = std::make_unique<Program>(port);
  Floor floor;
  auto opened = PluginDevice::open(at(port), floor.body[1].pose, {});
  REQUIRE_MESSAGE(opened, (opened ? "" : opened.error()));
  FloorRun run(floor, (*opened)->device());
  program->z = -0.02;
  run.check_loss([&] { program.reset(); },
                 [&] {
                   program = std::make_unique<Program>(port);
                   program->z = -0.02;
                 });
}

TEST_CASE("a second program is ignored while the first one sends") {
  const int port = free_port();
  Program first(port);
  Floor floor;
  auto opened = PluginDevice::open(at(port), floor.body[1].pose, {});
  REQUIRE_MESSAGE(opened, (opened ? "" : opened.error()));
  FloorRun run(floor, (*opened)->device());
  REQUIRE(run.until([](const h6FrameRecord& r) { return r.hand[0].sequence > 0; }));
  Program second(port);
  second.z = -0.02;
  run.rows.clear();
  REQUIRE(run.until([&](const h6FrameRecord&) { return run.rows.size() > 300; }));
  for (const h6FrameRecord& r : run.rows) CHECK(std::fabs(r.hand[0].pose.p.z - 5e-3) < 1e-9);
  CHECK(second.answers == 0);
}

TEST_CASE("without a program at the other end, open says where it listened") {
  const int port = free_port();
  auto opened = PluginDevice::open(at(port), {{0, 0, 0}, {1, 0, 0, 0}}, {});
  REQUIRE(!opened);
  CHECK(opened.error().find("no program sends poses to 127.0.0.1, UDP port " +
                            std::to_string(port)) != std::string::npos);
}
