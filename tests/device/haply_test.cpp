// SPDX-License-Identifier: Apache-2.0
// haply_test.cpp - the plug-in for Haply's devices against a service of ours that follows the
// documents: states out, a command in for each; killed, silent, fed garbage.
#include <doctest/doctest.h>

#include <atomic>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
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
namespace asio = boost::asio;
namespace beast = boost::beast;
using boost::system::error_code;
using nlohmann::json;

namespace {

const std::string library = HAPSIX_PLUGIN_FOLDER "/haply.so";
enum class Says { states, nothing, garbage, no_position, not_finite };

// Haply's service with an Inverse3 whose handle is pressed 20 mm down, and a turned VerseGrip.
class StandIn {
 public:
  explicit StandIn(unsigned short port = 0)
      : acceptor_(io_, {asio::ip::address_v4::loopback(), port}),
        port(acceptor_.local_endpoint().port()) {
    accept();
    thread_ = std::thread([this] { io_.run(); });
  }
  ~StandIn() {  // as a kill does: its sockets are closed by the system
    asio::post(io_, [this] { io_.stop(); });
    thread_.join();
  }
  std::atomic<Says> says{Says::states};
  std::atomic<bool> grip{true};
  std::atomic<double> z{0}, force{0};
  std::atomic<int> commands{0}, wrong{0};

 private:
  struct Client : std::enable_shared_from_this<Client> {
    Client(StandIn& owner, asio::ip::tcp::socket socket)
        : service(owner), stream(std::move(socket)), timer(owner.io_) {}
    void start() {
      stream.async_accept([self = shared_from_this()](error_code e) {
        if (!e) self->read(), self->send();
      });
    }
    // A state each millisecond, as the service sends them to one who answers.
    void send() {
      timer.expires_after(std::chrono::milliseconds(1));
      timer.async_wait([self = shared_from_this()](error_code e) {
        if (e) return;
        self->out = self->service.state();
        if (self->out.empty()) return self->send();
        self->stream.text(true);
        self->stream.async_write(asio::buffer(self->out), [self](error_code f, std::size_t) {
          if (!f) self->send();
        });
      });
    }
    void read() {
      stream.async_read(in, [self = shared_from_this()](error_code e, std::size_t) {
        if (e) return self->timer.cancel(), void();
        self->service.hear(beast::buffers_to_string(self->in.data()));
        self->in.consume(self->in.size());
        self->read();
      });
    }
    StandIn& service;
    beast::websocket::stream<beast::tcp_stream> stream;
    asio::steady_timer timer;
    beast::flat_buffer in;
    std::string out;
  };
  void accept() {
    acceptor_.async_accept([this](error_code e, asio::ip::tcp::socket socket) {
      if (e) return;
      std::make_shared<Client>(*this, std::move(socket))->start();
      accept();
    });
  }
  std::string state() const {
    switch (says.load()) {
      case Says::nothing:
        return "";
      case Says::garbage:
        return "{\"inverse3\": [{{{{ \xff\xfe";
      case Says::no_position:
        return R"({"inverse3":[{"device_id":"049D","state":{}}]})";
      case Says::not_finite:
        return R"({"inverse3":[{"device_id":"049D","state":{"cursor_position":{"x":1e999,"y":0,"z":0}}}]})";
      case Says::states:
        break;
    }
    const auto xyz = [](double x, double y, double zz) { return json{{"x", x}, {"y", y}, {"z", zz}}; };
    json all{{"inverse3",
              {{{"device_id", "049D"},
                {"state",
                 {{"cursor_position", xyz(0.01, -0.1, 0.2 + z)}, {"cursor_velocity", xyz(0, 0, 0)}}}}}}};
    if (grip)
      all["wireless_verse_grip"] = {
          {{"device_id", "61548"},
           {"state",
            {{"orientation", {{"w", 0.6}, {"x", 0.0}, {"y", 0.8}, {"z", 0.0}}},
             {"buttons", {{"a", true}, {"b", false}, {"c", true}}}}}}};
    return all.dump();
  }
  void hear(const std::string& text) {
    const json all = json::parse(text, nullptr, false);
    try {
      const json& device = all.at("inverse3").at(0);
      if (device.at("device_id") != "049D") ++wrong;
      force = device.at("commands").at("set_cursor_force").at("values").at("z").get<double>();
      ++commands;
    } catch (const std::exception&) {
      ++wrong;
    }
  }

  asio::io_context io_{1};
  asio::ip::tcp::acceptor acceptor_;
  std::thread thread_;

 public:
  const int port;
};

device::PluginFile at(int port) {
  return {library, {{"port", std::to_string(port)}, {"timeout", "500"}}};
}

}  // namespace

TEST_CASE("Haply's handle moves the part, its grip's buttons are there, and its force goes out") {
  StandIn service;
  Floor floor;
  auto opened = PluginDevice::open(at(service.port), floor.body[1].pose, {});
  REQUIRE_MESSAGE(opened, (opened ? "" : opened.error()));
  const h6Device device = (*opened)->device();
  CHECK(std::string(device.capabilities.name) == "Haply Inverse3 with VerseGrip");
  CHECK(device.capabilities.dof_in == 6);
  CHECK(device.capabilities.dof_out == 3);
  FloorRun run(floor, device);
  REQUIRE(run.until([](const h6FrameRecord& r) { return r.hand[0].buttons == 0b101; }));
  // It begins at home, whatever place and turn the device has.
  CHECK(std::fabs(run.rows.back().hand[0].pose.p.z - 5e-3) < 1e-12);
  CHECK(std::fabs(run.rows.back().hand[0].pose.q.w - 1) < 1e-12);
  service.z = -0.02;
  REQUIRE(run.force_comes());
  CHECK(std::fabs(run.rows.back().hand[0].pose.p.z + 0.015) < 1e-9);
  for (int i = 0; i < 400 && !(service.force > 0.5); ++i) {
    CHECK(run.force_comes());
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  CHECK(service.force > 0.5);
  CHECK(service.force <= 3 + 1e-6);
  CHECK(service.commands > 10);
  CHECK(service.wrong == 0);
}

TEST_CASE("an Inverse3 without a VerseGrip moves the part and does not turn it") {
  StandIn service;
  service.grip = false;
  Floor floor;
  auto opened = PluginDevice::open(at(service.port), floor.body[1].pose, {});
  REQUIRE_MESSAGE(opened, (opened ? "" : opened.error()));
  CHECK((*opened)->device().capabilities.dof_in == 3);
}

TEST_CASE("a service that is killed, silent or fed garbage: zero force, lost, armed only by hand") {
  auto service = std::make_unique<StandIn>();
  const int port = service->port;
  Floor floor;
  auto opened = PluginDevice::open(at(port), floor.body[1].pose, {});
  REQUIRE_MESSAGE(opened, (opened ? "" : opened.error()));
  FloorRun run(floor, (*opened)->device());
  service->z = -0.02;
  for (const Says says : {Says::nothing, Says::garbage, Says::no_position, Says::not_finite}) {
    CAPTURE(static_cast<int>(says));
    run.check_loss([&] { service->says = says; }, [&] { service->says = Says::states; });
  }
  run.check_loss([&] { service.reset(); },
                 [&] {
                   service = std::make_unique<StandIn>(static_cast<unsigned short>(port));
                   service->z = -0.02;
                 });
}

TEST_CASE("without a service, or without a device on it, open says where it looked") {
  unsigned short port;
  {
    StandIn service;
    port = static_cast<unsigned short>(service.port);
    service.says = Says::nothing;
    auto silent = PluginDevice::open(at(port), {{0, 0, 0}, {1, 0, 0, 0}}, {});
    REQUIRE(!silent);
    CHECK(silent.error().find("ws://127.0.0.1:" + std::to_string(port)) != std::string::npos);
  }
  auto gone = PluginDevice::open(at(port), {{0, 0, 0}, {1, 0, 0, 0}}, {});
  REQUIRE(!gone);
  CHECK(gone.error().find("does not answer at ws://127.0.0.1:" + std::to_string(port)) !=
        std::string::npos);
}
