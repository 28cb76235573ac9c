// SPDX-License-Identifier: Apache-2.0
#include "device/plugin.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <functional>
#include <future>
#include <thread>

namespace h6::device {
namespace {

static_assert(int{H6_PLUGIN_IMPEDANCE} == int{H6_IMPEDANCE} &&
              int{H6_PLUGIN_ADMITTANCE} == int{H6_ADMITTANCE} &&
              int{H6_PLUGIN_PSEUDO_ADMITTANCE} == int{H6_PSEUDO_ADMITTANCE});

void to(const h6Vec3& v, double* out) { out[0] = v.x, out[1] = v.y, out[2] = v.z; }
h6Vec3 vec(const double* v) { return {v[0], v[1], v[2]}; }
void to(const h6Quat& q, double* out) { out[0] = q.w, out[1] = q.x, out[2] = q.y, out[3] = q.z; }

using Clock = std::chrono::steady_clock;
constexpr double kCloseTime = 5;  // most that stop and close may take at the end [s]

// Calls `work` on a thread of its own and waits for its end, at most `seconds`. False when it is
// not over by then: nothing can end a thread from outside, so it is left to itself until the
// process ends. Hence `work` must own all that it uses. An exception of `work` is thrown again
// here.
bool ends_within(double seconds, std::function<void()> work) {
  std::packaged_task<void()> task(std::move(work));
  std::future<void> over = task.get_future();
  std::thread(std::move(task)).detach();
  if (over.wait_for(std::chrono::duration<double>(seconds)) != std::future_status::ready)
    return false;
  over.get();
  return true;
}

// A loaded library and its table of functions; no device is open yet.
struct Loaded {
  void* library = nullptr;
  const h6DevicePluginV1* plugin = nullptr;
};

// Without a slash the loader would look in the system's folders.
std::string loader_path(const std::string& path) {
  return path.find('/') == std::string::npos ? "./" + path : path;
}

Result<Loaded> load(const std::string& path) {
  Loaded loaded;
  loaded.library = dlopen(loader_path(path).c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!loaded.library) {
    const char* why = dlerror();
    return Failure{path + ": cannot be loaded (" + (why ? why : "no reason given") + ")"};
  }
  loaded.plugin =
      static_cast<const h6DevicePluginV1*>(dlsym(loaded.library, "h6_device_plugin_v1"));
  std::string wrong;
  if (!loaded.plugin)
    wrong =
        "has no symbol h6_device_plugin_v1: it is no hapsix plug-in, or does not export it "
        "(device_plugin.h)";
  else if (loaded.plugin->abi != H6_PLUGIN_ABI)
    wrong = "is for version " + std::to_string(loaded.plugin->abi) +
            " of the plug-in interface, this program has version " + std::to_string(H6_PLUGIN_ABI) +
            ": build it again with this program's device_plugin.h";
  else if (loaded.plugin->size != sizeof(h6DevicePluginV1))
    wrong = "was built with another device_plugin.h: build it again with this program's";
  else if (!loaded.plugin->open || !loaded.plugin->read || !loaded.plugin->write ||
           !loaded.plugin->stop || !loaded.plugin->close)
    wrong = "lacks one of open, read, write, stop, close";
  if (wrong.empty()) return loaded;
  dlclose(loaded.library);
  return Failure{path + ": " + wrong};
}

bool sensible(double value) { return value >= 0 && value <= 1e9; }

Result<void*> open_in(const h6DevicePluginV1& plugin, const PluginFile& file, const h6Pose& home,
                      const h6Vec3& grip, h6PluginCapabilities& capabilities) {
  std::vector<h6PluginOption> options;
  for (const auto& [key, value] : file.options) options.push_back({key.c_str(), value.c_str()});
  h6PluginStart start{};
  start.options = options.data(), start.option_count = options.size();
  to(home.p, start.home_position), to(home.q, start.home_orientation), to(grip, start.grip);
  void* device = nullptr;
  char error[256] = "";
  capabilities = {};
  if (plugin.open(&start, &capabilities, &device, error, sizeof error) != 0) {
    error[sizeof error - 1] = '\0';
    return Failure{file.path + ": " + (error[0] ? error : "its open failed and did not say why")};
  }
  if (const std::string what = nonsense_in(capabilities); !what.empty()) {
    plugin.close(device);
    return Failure{file.path + ": its capabilities make no sense: " + what};
  }
  return device;
}

// Runs in the child. Returns a sentence, empty when all went well.
std::string try_it(const PluginFile& file, const h6Pose& home, const h6Vec3& grip) {
  Result<Loaded> loaded = load(file.path);
  if (!loaded) return loaded.error();
  h6PluginCapabilities capabilities;
  Result<void*> opened = open_in(*loaded->plugin, file, home, grip, capabilities);
  if (!opened) return opened.error();
  h6PluginSample sample{};
  (void)loaded->plugin->read(*opened, 0, &sample);
  loaded->plugin->stop(*opened);
  loaded->plugin->close(*opened);
  return "";
}

// Work on the plug-in of `path` that may crash or hang. Returns a sentence, empty when it
// succeeded.
struct Trial {
  const std::string& path;
  std::function<std::string()> work;
};

[[noreturn]] void be_the_child(int answer_to, const Trial& trial) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);  // a plug-in that hangs does not outlive this program
  for (const int number : {SIGINT, SIGTERM, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT})
    signal(number, SIG_DFL);
  const rlimit none{0, 0};
  setrlimit(RLIMIT_CORE, &none);
  dup2(STDERR_FILENO, STDOUT_FILENO);  // stdout may be a JSON object of the parent's
  std::string answer = "+";
  try {
    answer += trial.work();
  } catch (...) {
    answer += trial.path + ": threw an exception out of C";
  }
  (void)!write(answer_to, answer.data(), answer.size());
  _exit(0);
}

// Reads the pipe to its end, or 10,000 bytes; false at `end`.
bool listen(int from, Clock::time_point end, std::string& heard) {
  char bytes[512];
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now());
    pollfd wait{from, POLLIN, 0};
    const int ready = left.count() < 0 ? 0 : poll(&wait, 1, static_cast<int>(left.count()));
    if (ready < 0 && errno == EINTR) continue;
    if (ready <= 0) return false;
    const ssize_t n = ::read(from, bytes, sizeof bytes);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return true;
    heard.append(bytes, static_cast<std::size_t>(n));
    if (heard.size() > 10000) return true;
  }
}

// Waits for the end of `child`, which may close its pipe and go on; kills it at `end` and returns
// false.
bool over(pid_t child, Clock::time_point end, int& status) {
  for (bool in_time = true;;) {
    const pid_t gone = waitpid(child, &status, in_time ? WNOHANG : 0);
    if (gone == child || (gone < 0 && errno != EINTR)) return in_time;
    if (gone < 0) continue;
    in_time = Clock::now() < end;
    if (!in_time) kill(child, SIGKILL);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

std::string seconds_text(double seconds) {
  char text[32];
  std::snprintf(text, sizeof text, "%g s", seconds);
  return text;
}

Outcome in_child(const Trial& trial, double patience) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0)
    return Failure{trial.path + ": cannot be tried out, no pipe (" + std::strerror(errno) + ")"};
  std::fflush(nullptr);  // else the child would write buffered output a second time
  const pid_t child = fork();
  if (child == 0) {
    close(ends[0]);
    be_the_child(ends[1], trial);
  }
  close(ends[1]);
  std::string heard;
  const auto end = Clock::now() + std::chrono::milliseconds(std::lround(1e3 * patience));
  bool in_time = child > 0 && listen(ends[0], end, heard);
  close(ends[0]);
  if (child < 0)
    return Failure{trial.path + ": cannot be tried out, no process (" + std::strerror(errno) + ")"};
  int status = 0;
  in_time = over(child, in_time ? end : Clock::now(), status) && in_time;
  if (!in_time)
    return Failure{trial.path + ": its open did not end within " + seconds_text(patience) +
                   ": it hangs, or waits for a device that is not there"};
  if (heard == "+") return Done{};
  if (!heard.empty()) return Failure{heard.substr(1)};
  if (WIFSIGNALED(status))
    return Failure{trial.path + ": crashed while it was opened (" + strsignal(WTERMSIG(status)) +
                   "): a fault of the plug-in"};
  return Failure{trial.path + ": ended the process while it was opened (exit code " +
                 std::to_string(WEXITSTATUS(status)) + ")"};
}

// What a thread that hangs in the plug-in keeps alive.
struct Opening {
  PluginFile file;
  h6Pose home;
  h6Vec3 grip;
  h6PluginCapabilities capabilities{};
  Loaded loaded;
  void* device = nullptr;
  std::string wrong;
};

Result<std::shared_ptr<Opening>> open_here(const PluginFile& file, const h6Pose& home,
                                           const h6Vec3& grip, double patience) {
  auto o = std::make_shared<Opening>(Opening{file, home, grip, {}, {}, nullptr, ""});
  const bool in_time = ends_within(patience, [o] {
    Result<Loaded> loaded = load(o->file.path);
    if (!loaded) {
      o->wrong = loaded.error();
      return;
    }
    o->loaded = *loaded;
    Result<void*> opened = open_in(*loaded->plugin, o->file, o->home, o->grip, o->capabilities);
    if (opened)
      o->device = *opened;
    else
      o->wrong = opened.error();
  });
  if (!in_time)
    return Failure{file.path + ": its open did not end within " + seconds_text(patience) +
                   " the second time: it cannot be opened again after a close"};
  // After a failure the library stays loaded, because its destructor may hang.
  if (o->wrong.empty()) return o;
  return Failure{o->wrong};
}

}  // namespace

std::string nonsense_in(const h6PluginCapabilities& c) {
  if (!std::memchr(c.name, 0, sizeof c.name)) return "name without an end";
  if (c.dof_in != 3 && c.dof_in != 6) return "dof_in, which must be 3 or 6";
  if (c.dof_out != 0 && c.dof_out != 3 && c.dof_out != 6) return "dof_out, which must be 0, 3 or 6";
  constexpr std::uint32_t modes =
      H6_PLUGIN_IMPEDANCE | H6_PLUGIN_ADMITTANCE | H6_PLUGIN_PSEUDO_ADMITTANCE;
  if (c.modes == 0 || (c.modes & ~modes)) return "modes";
  const double figures[] = {c.max_force,    c.max_torque, c.max_force_rate, c.max_torque_rate,
                            c.max_velocity, c.rate,       c.freeze_time};
  for (const double figure : figures)
    if (!sensible(figure)) return "ratings, which must be 0 or more";
  for (int i = 0; i < 3; ++i)
    if (!(std::fabs(c.workspace_min[i]) <= 1e6 && std::fabs(c.workspace_max[i]) <= 1e6 &&
          c.workspace_min[i] <= c.workspace_max[i]))
      return "workspace";
  return "";
}

Outcome PluginDevice::loads(const std::string& path, double patience) {
  const auto load_it = [&] {
    const Result<Loaded> loaded = load(path);
    return loaded ? std::string{} : loaded.error();
  };
  return in_child({path, load_it}, patience);
}

Result<std::unique_ptr<PluginDevice>> PluginDevice::open(const PluginFile& file, const h6Pose& home,
                                                         const h6Vec3& grip, double patience) {
  std::error_code ignored;
  if (file.path.empty()) return Failure{"a plug-in needs its file: plugin:PATH"};
  if (!std::filesystem::exists(file.path, ignored))
    return Failure{file.path + ": there is no such file"};
  const Trial trial{file.path, [&] { return try_it(file, home, grip); }};
  if (Outcome good = in_child(trial, patience); !good) return good.failure();
  const Result<std::shared_ptr<Opening>> opened = open_here(file, home, grip, patience);
  if (!opened) return opened.failure();
  const Opening& o = **opened;
  std::unique_ptr<PluginDevice> made(new PluginDevice);
  made->library_ = o.loaded.library;
  made->plugin_ = o.loaded.plugin;
  made->device_ = o.device;
  made->capabilities_ = o.capabilities;
  if (o.loaded.plugin->about) made->about_ = o.loaded.plugin->about;
  return made;
}

PluginDevice::~PluginDevice() {
  if (!plugin_) return;
  // A library that hangs in its close stays loaded until the process ends.
  (void)ends_within(kCloseTime, [plugin = plugin_, device = device_, library = library_] {
    plugin->stop(device);
    plugin->close(device);
    dlclose(library);
  });
}

int PluginDevice::read(double time, h6DeviceSample& out) {
  h6PluginSample s{};
  s.orientation[0] = 1;
  if (plugin_->read(device_, time, &s) != 0) return 1;
  out = {};
  out.pose.p = vec(s.position);
  out.pose.q = {s.orientation[0], s.orientation[1], s.orientation[2], s.orientation[3]};
  out.velocity = {vec(s.linear), vec(s.angular)};
  out.wrench = {vec(s.force), vec(s.torque)};
  out.buttons = s.buttons;
  out.sequence = s.sequence;
  return 0;
}

int PluginDevice::write(double time, const h6DeviceCommand& command) {
  h6PluginCommand c{};
  to(command.wrench.force, c.force), to(command.wrench.torque, c.torque);
  to(command.pose.p, c.position), to(command.pose.q, c.orientation);
  to(command.velocity.linear, c.linear), to(command.velocity.angular, c.angular);
  c.cause = static_cast<std::uint32_t>(command.cause);
  return plugin_->write(device_, time, &c);
}

int PluginDevice::arm() { return plugin_->arm ? plugin_->arm(device_) : 0; }

h6Device PluginDevice::device() {
  h6Device d{};
  d.self = this;
  const h6PluginCapabilities& from = capabilities_;
  h6DeviceCapabilities& c = d.capabilities;
  std::snprintf(c.name, sizeof c.name, "%s", from.name);
  c.dof_in = from.dof_in, c.dof_out = from.dof_out;
  c.max_force = from.max_force, c.max_torque = from.max_torque;
  c.max_force_rate = from.max_force_rate, c.max_torque_rate = from.max_torque_rate;
  c.max_velocity = from.max_velocity;
  c.workspace_min = vec(from.workspace_min), c.workspace_max = vec(from.workspace_max);
  c.rate = from.rate;
  c.modes = from.modes;
  c.freeze_time = from.freeze_time;
  d.read = [](void* self, double time, h6DeviceSample* out) {
    return static_cast<PluginDevice*>(self)->read(time, *out);
  };
  d.write = [](void* self, double time, const h6DeviceCommand* command) {
    return static_cast<PluginDevice*>(self)->write(time, *command);
  };
  d.stop = [](void* self) {
    auto& plugin = *static_cast<PluginDevice*>(self);
    plugin.plugin_->stop(plugin.device_);
  };
  d.arm = [](void* self) { return static_cast<PluginDevice*>(self)->arm(); };
  return d;
}

}  // namespace h6::device
