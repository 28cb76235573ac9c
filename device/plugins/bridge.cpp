// SPDX-License-Identifier: Apache-2.0
// bridge.cpp - a plug-in for a device behind a program in any language: JSON in UDP datagrams.
//
//   hapsix run SCENE --device 'plugin:build/release/plugins/bridge.so?port=47807'
//
//   program --> {"n": 12, "p": [x, y, z], "q": [w, x, y, z], "v": [...], "w": [...], "buttons": 0}
//   program <-- {"n": 12, "f": [x, y, z], "t": [x, y, z], "live": true, "cause": 0}
//
// p and q are the handle's place and orientation in its own frame, whose axes are the world's [m];
// v and w its velocities [m/s], [rad/s], and may be left out, as may buttons. f and t are force and
// torque on the hand [N], [N m]. Send one datagram a millisecond; each is answered at once with the
// newest wrench, so the answer also says that the host lives: a device must go to zero force by itself
// when no answer came for some 20 ms.
//
// Loss. Datagrams are numbered upwards by n. One that is lost is not missed: the next has all there
// is. One that is older than the newest is left out. When nothing that is right came for `timeout`
// (20 ms), the device is lost and the answers are zero until a person arms it again. The first program
// that sends has the hand; others are ignored until it has been silent for a second.
// device/plugins/bridge_example.py is a program at the other end.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <thread>

#include "device/plugins/bridge_message.h"
#include "device/plugins/mailbox.h"

namespace {

using h6::plugin::Heard;
using h6::plugin::Mailbox;
using h6::plugin::now;

constexpr double kOwner = 1;  // a program silent for so long gives its place away [s]

struct Options {
  int port = 47807;
  double timeout = 0.02, max_force = 10, max_torque = 1;
};

class Bridge {
 public:
  Bridge(int socket, Mailbox& box) : socket_(socket), box_(box), thread_([this] { run(); }) {}
  ~Bridge() {
    ended_ = true;
    thread_.join();
    close(socket_);
  }

 private:
  void run() {
    char text[1024];
    while (!ended_) {
      pollfd wait{socket_, POLLIN, 0};
      if (poll(&wait, 1, 50) <= 0) continue;
      sockaddr_in from{};
      socklen_t size = sizeof from;
      const ssize_t bytes = recvfrom(socket_, text, sizeof text, MSG_TRUNC,
                                     reinterpret_cast<sockaddr*>(&from), &size);
      if (bytes <= 0 || bytes > static_cast<ssize_t>(sizeof text)) continue;
      const bool owner = from.sin_addr.s_addr == owner_.sin_addr.s_addr &&
                         from.sin_port == owner_.sin_port;
      if (!owner && now() - heard_at_ < kOwner) continue;
      if (!take({text, static_cast<std::size_t>(bytes)}, owner)) continue;
      owner_ = from;
      answer();
    }
  }
  bool take(std::string_view text, bool owner) {
    h6::plugin::BridgeMessage in;
    if (!h6::plugin::parse_bridge(text, in)) return false;
    if (owner && in.number <= number_ && now() - heard_at_ < kOwner) return false;
    if (!first_) first_ = std::make_unique<h6::plugin::BridgeMessage>(in);
    Heard h;
    h6_turned(in.q, first_->q, h.grip.turned);
    for (int i = 0; i < 3; ++i) {
      h.grip.moved[i] = in.p[i] - first_->p[i];
      h.grip.linear[i] = in.v[i], h.grip.angular[i] = in.w[i];
    }
    h.buttons = in.buttons;
    number_ = in.number;
    h.sequence = ++count_;
    h.at = heard_at_ = now();
    box_.put(h);
    return true;
  }
  void answer() const {
    const h6::plugin::Wanted w = box_.wrench();
    char out[320];
    const int size = std::snprintf(
        out, sizeof out,
        "{\"n\":%lld,\"f\":[%.6f,%.6f,%.6f],\"t\":[%.6f,%.6f,%.6f],\"live\":%s,\"cause\":%u}",
        static_cast<long long>(number_), w.force[0], w.force[1], w.force[2], w.torque[0],
        w.torque[1], w.torque[2], w.at > 0 ? "true" : "false", static_cast<unsigned>(w.cause));
    (void)!sendto(socket_, out, static_cast<std::size_t>(size), MSG_DONTWAIT | MSG_NOSIGNAL,
                  reinterpret_cast<const sockaddr*>(&owner_), sizeof owner_);
  }

  const int socket_;
  Mailbox& box_;
  sockaddr_in owner_{};
  double heard_at_ = -kOwner;
  std::int64_t number_ = 0;
  std::uint64_t count_ = 0;
  std::unique_ptr<h6::plugin::BridgeMessage> first_;
  std::atomic<bool> ended_{false};
  std::thread thread_;  // last: it uses the members above
};

struct Device {
  h6PluginStart start;
  Options options;
  Mailbox box;
  std::unique_ptr<Bridge> bridge;
};

bool take_option(const h6PluginOption& given, Options& o, std::string& wrong) {
  const std::string key = given.key, value = given.value;
  const double number = std::atof(given.value);
  const auto within = [&](double low, double high, const char* range) {
    if (!(number >= low && number <= high)) wrong = key + " must be " + range + ", not " + value;
    return number;
  };
  if (key == "port") o.port = static_cast<int>(within(1, 65535, "1 to 65535"));
  else if (key == "timeout") o.timeout = 1e-3 * within(2, 1000, "2 to 1000 ms");
  else if (key == "max_force") o.max_force = within(1e-3, 1000, "up to 1000 N");
  else if (key == "max_torque") o.max_torque = within(0, 100, "0 to 100 N m");
  else wrong = "the options are port, timeout, max_force and max_torque, not " + key;
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
  sockaddr_in here{};
  here.sin_family = AF_INET;
  here.sin_port = htons(static_cast<std::uint16_t>(d->options.port));
  here.sin_addr.s_addr = htonl(INADDR_LOOPBACK);  // this machine only
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (socket < 0 || bind(socket, reinterpret_cast<sockaddr*>(&here), sizeof here) != 0) {
    if (socket >= 0) close(socket);
    return fail(error, size, "UDP port " + std::to_string(d->options.port) +
                                 " cannot be taken (" + std::strerror(errno) + ")");
  }
  d->bridge = std::make_unique<Bridge>(socket, d->box);
  h6PluginSample sample;
  for (const double end = now() + 3; !d->box.get(d->start, 0.5, &sample);) {
    if (now() > end)
      return fail(error, size, "no program sends poses to 127.0.0.1, UDP port " +
                                   std::to_string(d->options.port) + ": start it first");
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  std::snprintf(can->name, sizeof can->name, "bridge");
  can->dof_in = 6, can->dof_out = d->options.max_torque > 0 ? 6 : 3;
  can->max_force = d->options.max_force, can->max_torque = d->options.max_torque;
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
void close_device(void* device) { delete &of(device); }

}  // namespace

extern "C" H6_PLUGIN_EXPORT const h6DevicePluginV1 h6_device_plugin_v1 = {
    H6_PLUGIN_ABI,
    sizeof(h6DevicePluginV1),
    "A program in any language, over UDP with JSON (bridge.cpp says how); options: port, timeout "
    "[ms], max_force [N], max_torque [N m].",
    open_device,
    read_device,
    write_device,
    stop_device,
    arm_device,
    close_device};
