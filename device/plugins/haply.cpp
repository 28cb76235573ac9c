// SPDX-License-Identifier: Apache-2.0
// haply.cpp - a plug-in for Haply's Inverse3 with a VerseGrip, through Haply's service.
//
//   hapsix run SCENE --device 'plugin:build/release/plugins/haply.so?port=10001'
//
// The service speaks JSON over a WebSocket of this machine. It sends the states of its devices, and
// answers a command with the next states (the crate `haply` on docs.rs; Isaac Lab's HaplyDevice):
//
//   in    {"inverse3": [{"device_id": "049D", "state": {"cursor_position": {"x", "y", "z"},
//          "cursor_velocity": {...}}}], "wireless_verse_grip": [{"state": {"orientation":
//          {"w", "x", "y", "z"}, "buttons": {"a": false, "b": false, "c": false}}}]}
//   out   {"inverse3": [{"device_id": "049D", "commands": {"set_cursor_force": {"values":
//          {"x", "y", "z"}}}}]}                                                      [m], [m/s], [N]
//
// The Inverse3 gives three forces and no torque. A state without a position, one that is no JSON or
// not finite, and a service that falls silent are all a lost device; the connection is made anew, and
// only a person arms it again. Nothing here was tried with hardware.
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "device/plugins/haply_message.h"
#include "device/plugins/mailbox.h"

namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using boost::system::error_code;
using h6::plugin::Heard;
using h6::plugin::Mailbox;
using h6::plugin::HaplySaid;
using h6::plugin::HaplyState;
using nlohmann::json;
using Stream = websocket::stream<beast::tcp_stream>;

constexpr auto kPause = std::chrono::milliseconds(200);  // before the next attempt to connect
constexpr std::size_t kLongest = 1 << 20;                // of a message [bytes]

struct Options {
  std::string host = "127.0.0.1";
  int port = 10001;
  double timeout = 0.1;  // [s]
  double max_force = 3;  // [N]
};

// The service's connection, on a thread of its own.
class Service {
 public:
  Service(const Options& options, Mailbox& box) : options_(options), box_(box) {
    connect();
    thread_ = std::thread([this] { io_.run(); });
  }
  ~Service() {
    asio::post(io_, [this] { io_.stop(); });
    thread_.join();
  }
  bool grip() const { return grip_.load(); }
  bool connected() const { return connected_.load(); }

 private:
  void connect() {
    stream_ = std::make_unique<Stream>(io_);
    buffer_.clear();
    id_.clear();
    auto& tcp = beast::get_lowest_layer(*stream_);
    tcp.expires_after(std::chrono::seconds(1));
    error_code failed;
    const auto address = asio::ip::make_address(options_.host, failed);
    tcp.async_connect({address, static_cast<unsigned short>(options_.port)}, [this](error_code e) {
      if (e) return again();
      beast::get_lowest_layer(*stream_).expires_never();
      beast::get_lowest_layer(*stream_).socket().set_option(asio::ip::tcp::no_delay(true), e);
      websocket::stream_base::timeout limits{std::chrono::seconds(1), std::chrono::seconds(1), false};
      stream_->set_option(limits);  // a service silent for a second is connected to anew
      stream_->read_message_max(kLongest);
      stream_->async_handshake(options_.host + ":" + std::to_string(options_.port), "/",
                               [this](error_code f) { f ? again() : (connected_ = true, read()); });
    });
  }
  void again() {
    connected_ = false;
    box_.lose();
    pause_.expires_after(kPause);
    pause_.async_wait([this](error_code e) {
      if (!e) connect();
    });
  }
  void read() {
    stream_->async_read(buffer_, [this](error_code e, std::size_t) {
      if (e || !take()) return again();
      answer();
    });
  }
  // The states just read. False: this is no service of Haply's, or it has lost its device.
  bool take() {
    const auto bytes = buffer_.cdata();
    const char* text = static_cast<const char*>(bytes.data());
    HaplyState state;
    const HaplySaid said = h6::plugin::parse_haply({text, bytes.size()}, state);
    buffer_.consume(buffer_.size());
    // Before the first state it may speak of other things.
    if (said == HaplySaid::other) return id_.empty();
    if (said == HaplySaid::nonsense) return false;
    id_ = state.id;
    put(state);
    return true;
  }
  // What it did since the first state ever: a service that was started again has the same axes, and
  // the handle is where it is.
  void put(const HaplyState& s) {
    if (!first_) first_ = std::make_unique<HaplyState>(s);
    Heard h;
    h6_turned(s.orientation, first_->orientation, h.grip.turned);
    for (int i = 0; i < 3; ++i) {
      h.grip.moved[i] = s.position[i] - first_->position[i];
      h.grip.linear[i] = s.velocity[i];
    }
    h.buttons = s.buttons;
    h.sequence = ++count_;
    h.at = h6::plugin::now();
    grip_ = s.grip;
    box_.put(h);
  }
  // A command for every state, since the service answers each with the next.
  void answer() {
    if (id_.empty()) return read();
    const h6::plugin::Wanted w = box_.wrench();
    char number[128];
    std::snprintf(number, sizeof number, "{\"x\":%.6f,\"y\":%.6f,\"z\":%.6f}", w.force[0],
                  w.force[1], w.force[2]);
    said_ = "{\"inverse3\":[{\"device_id\":" + json(id_).dump() +
            ",\"commands\":{\"set_cursor_force\":{\"values\":" + number + "}}}]}";
    stream_->text(true);
    stream_->async_write(asio::buffer(said_),
                         [this](error_code e, std::size_t) { e ? again() : read(); });
  }

  Options options_;
  Mailbox& box_;
  asio::io_context io_{1};
  asio::steady_timer pause_{io_};
  std::unique_ptr<Stream> stream_;
  beast::flat_buffer buffer_;
  std::string id_, said_;
  std::unique_ptr<HaplyState> first_;
  std::uint64_t count_ = 0;
  std::atomic<bool> grip_{false}, connected_{false};
  std::thread thread_;
};

struct Device {
  h6PluginStart start;
  Options options;
  Mailbox box;
  std::unique_ptr<Service> service;
};

bool take_option(const h6PluginOption& given, Options& o, std::string& wrong) {
  const std::string key = given.key, value = given.value;
  const double number = std::atof(given.value);
  error_code failed;
  if (key == "host") {
    asio::ip::make_address(value, failed);
    if (failed) wrong = "host must be an address like 127.0.0.1, not " + value;
    o.host = value;
  } else if (key == "port") {
    if (!(number >= 1 && number <= 65535)) wrong = "port must be 1 to 65535, not " + value;
    o.port = static_cast<int>(number);
  } else if (key == "timeout") {
    if (!(number >= 5 && number <= 1000)) wrong = "timeout must be 5 to 1000 ms, not " + value;
    o.timeout = 1e-3 * number;
  } else if (key == "max_force") {
    if (!(number > 0 && number <= 10)) wrong = "max_force must be above 0 and at most 10 N";
    o.max_force = number;
  } else {
    wrong = "the options are host, port, timeout and max_force, not " + key;
  }
  return wrong.empty();
}

int fail(char* error, std::size_t size, const std::string& what) {
  std::snprintf(error, size, "%s", what.c_str());
  return 1;
}

int open_device(const h6PluginStart* start, h6PluginCapabilities* can, void** device, char* error,
                std::size_t size) try {
  auto d = std::make_unique<Device>();
  std::string wrong;
  for (std::size_t i = 0; i < start->option_count; ++i)
    if (!take_option(start->options[i], d->options, wrong)) return fail(error, size, wrong);
  d->start = *start;
  d->start.options = nullptr, d->start.option_count = 0;
  d->service = std::make_unique<Service>(d->options, d->box);
  h6PluginSample sample;
  const double end = h6::plugin::now() + 3;
  while (!d->box.get(d->start, d->options.timeout, &sample)) {
    if (h6::plugin::now() > end)
      return fail(error, size,
                  (d->service->connected() ? "Haply's service has no Inverse3 at ws://"
                                           : "Haply's service does not answer at ws://") +
                      d->options.host + ":" + std::to_string(d->options.port) +
                      ": start it, and connect the device");
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  const bool turns = d->service->grip();
  std::snprintf(can->name, sizeof can->name, "Haply Inverse3%s", turns ? " with VerseGrip" : "");
  can->dof_in = turns ? 6 : 3, can->dof_out = 3;
  can->max_force = d->options.max_force;
  can->rate = 1000;
  // A silent device is lost after the timeout; the host would call it frozen before.
  can->freeze_time = 2 * d->options.timeout;
  can->modes = H6_PLUGIN_IMPEDANCE;
  *device = d.release();
  return 0;
} catch (const std::exception& e) {
  return fail(error, size, e.what());
}

Device& of(void* device) { return *static_cast<Device*>(device); }

int read_device(void* device, double, h6PluginSample* out) {
  return of(device).box.get(of(device).start, of(device).options.timeout, out) ? 0 : 1;
}
int write_device(void* device, double, const h6PluginCommand* command) {
  of(device).box.command(*command);
  return 0;
}
void stop_device(void* device) { of(device).box.stop(); }
int arm_device(void* device) {
  of(device).box.arm();
  return 0;
}
void close_device(void* device) {
  Device* d = &of(device);
  d->box.stop();
  std::this_thread::sleep_for(std::chrono::milliseconds(20));  // a zero goes out with the next state
  delete d;
}

}  // namespace

extern "C" H6_PLUGIN_EXPORT const h6DevicePluginV1 h6_device_plugin_v1 = {
    H6_PLUGIN_ABI,
    sizeof(h6DevicePluginV1),
    "Haply Inverse3 with VerseGrip through Haply's service; options: host, port, timeout [ms], "
    "max_force [N].",
    open_device,
    read_device,
    write_device,
    stop_device,
    arm_device,
    close_device};
