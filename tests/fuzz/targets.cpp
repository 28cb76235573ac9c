// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/targets.h"

#include <fcntl.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <vector>

#include "device/device_spec.h"
#include "device/plugin.h"
#include "device/plugins/bridge_message.h"
#include "device/plugins/haply_message.h"
#include "device/plugins/udp_arm_protocol.h"
#include "device/scripted_hand.h"
#include "device/spacemouse_report.h"
#include "io/deform/deformable_file.h"
#include "io/deform/solid_file.h"
#include "io/field/field_file.h"
#include "io/field/raw_field.h"
#include "io/file/content_hash.h"
#include "io/file/gunzip.h"
#include "io/mesh/mesh.h"
#include "io/mesh/mesh_file.h"
#include "io/record/log.h"
#include "io/record/recording.h"
#include "io/scene/scene_file.h"
#include "io/shell/shell_file.h"
#include "io/view/pick_request.h"
#include "io/view/view_request.h"

namespace h6::fuzz {
namespace {

namespace fs = std::filesystem;

template <const char* Name>
void take_mesh(std::string_view bytes) {
  const auto mesh = io::parse_mesh(std::string(bytes), Name);
  if (!mesh) return check_sentence(mesh.error());
  promise(!mesh->triangles.empty(), "a mesh has triangles");
  for (const auto& t : mesh->triangles)
    for (const auto v : t) promise(v < mesh->vertices.size(), "a triangle names vertices");
  for (const auto& p : mesh->vertices)
    promise(std::abs(p.x) <= 1e6 && std::abs(p.y) <= 1e6 && std::abs(p.z) <= 1e6,
            "vertices lie within 1e6 m");
}
constexpr char kStl[] = "m.stl", kObj[] = "m.obj", kPly[] = "m.ply", kGltf[] = "m.gltf",
               kGlb[] = "m.glb", kDae[] = "m.dae", kGz[] = "m.stl.gz";

template <const char* Name>
void take_solid(std::string_view bytes) {
  const auto mesh = io::parse_solid(std::string(bytes), Name);
  if (!mesh) return check_sentence(mesh.error());
  promise(!mesh->elements.empty(), "a solid mesh has elements");
  for (const auto& e : mesh->elements)
    for (std::uint32_t a = 0; a < e.corners; ++a)
      promise(e.corner[a] < mesh->vertices.size(), "an element names vertices");
  for (const auto& p : mesh->vertices)
    promise(std::abs(p.x) <= 1e6 && std::abs(p.y) <= 1e6 && std::abs(p.z) <= 1e6,
            "vertices lie within 1e6 m");
  if (const auto facts = io::check_solid(*mesh, true); !facts) check_sentence(facts.error());
}
constexpr char kVeg[] = "m.veg", kMsh[] = "m.msh", kVtk[] = "m.vtk";

void take_deformable(std::string_view bytes) {
  const auto model = io::read_deformable(as_file(bytes, "d.h5"));
  if (!model) return check_sentence(model.error());
  promise(io::consistent(*model), "the arrays of a reduced model fit each other");
}

void take_shell(std::string_view bytes) {
  const auto shell = io::parse_shell(bytes, "s.ply");
  if (!shell) return check_sentence(shell.error());
  promise(shell->size() > 0, "a shell has points");
}

// A checksum would stop nearly every changed file at its door. An author of bad files computes it.
std::string sealed_field(std::string_view bytes) {
  constexpr std::size_t page = 4096, block = std::size_t{4} << 20, at = 128;  // raw_field.cpp
  std::string file(bytes);
  if (file.size() < page) return file;
  std::vector<io::Hash128> hashes;
  for (std::size_t i = page; i < file.size(); i += block)
    hashes.push_back(io::hash_bytes(&file[i], std::min(block, file.size() - i)));
  const auto put = [&](const io::Hash128& hash) { std::memcpy(&file[at], &hash, sizeof hash); };
  put(io::hash_bytes(hashes.data(), hashes.size() * sizeof(io::Hash128)));
  put(io::hash_bytes(file.data(), page));
  return file;
}

void take_field(std::string_view bytes) {
  const auto field = io::read_raw_field(as_file(sealed_field(bytes), "f.field"));
  if (!field) check_sentence(field.error());
}

void take_vdb(std::string_view bytes) {
  const auto field = io::read_field(as_file(bytes, "f.vdb"));
  if (!field) check_sentence(field.error());
}

void take_scene(std::string_view bytes) {
  const auto text = io::read_scene_text(std::string(bytes), "scene.json");
  if (!text) check_sentence(text.error());
  const auto file = io::read_scene(as_file(bytes, "scene.json"));
  if (!file) check_sentence(file.error());
}

void take_path(std::string_view bytes) {
  const auto path = io::read_path(as_file(bytes, "p.csv"), io::Unit::mm);
  if (!path) return check_sentence(path.error());
  promise(!path->empty(), "a path has rows");
  double last = -1e300;
  for (const auto& row : *path) {
    promise(std::isfinite(row.t) && row.t >= last, "times rise");
    last = row.t;
    promise(std::isfinite(row.pose.p.x + row.pose.p.y + row.pose.p.z), "positions are finite");
  }
}

void take_script(std::string_view bytes) {
  const auto script =
      device::read_hand_script(std::string(bytes), 1e-3, {{0, 0, 0}, {1, 0, 0, 0}}, {});
  if (!script) check_sentence(script.error());
}

void take_spec(std::string_view bytes) {
  const auto spec = device::parse_device_spec(std::string(bytes));
  if (!spec) return check_sentence(spec.error());
  device::OptionReader read(*spec);
  double number = 1;
  unsigned long long whole = 1;
  bool yes = false;
  read.number("speed", 0, 10, number), read.whole("seed", 100, whole), read.yes_no("on", yes);
  (void)read.finish();
  promise(number >= 0 && number <= 10 && whole <= 100, "options stay in their ranges");
}

void take_hid(std::string_view bytes) {
  const auto* from = reinterpret_cast<const std::uint8_t*>(bytes.data());
  const std::size_t cut = bytes.empty() ? 0 : from[0] % (bytes.size() + 1);
  const auto layout = device::layout_of_descriptor({from, cut});
  device::SpaceMouseState state;
  for (std::size_t at = cut; at < bytes.size(); at += 13)
    (void)device::take_report({from + at, std::min<std::size_t>(13, bytes.size() - at)}, layout,
                              state);
}

void take_bridge(std::string_view bytes) {
  plugin::BridgeMessage in;
  if (!plugin::parse_bridge(bytes, in)) return;
  const double length = std::hypot(std::hypot(in.q[0], in.q[1]), std::hypot(in.q[2], in.q[3]));
  promise(std::fabs(length - 1) < 1e-9, "a hand has an orientation");
  for (int i = 0; i < 3; ++i)
    promise(std::fabs(in.p[i]) <= 100 && std::fabs(in.v[i]) <= 100 && std::fabs(in.w[i]) <= 1000,
            "a hand's pose and velocity are in range");
}

void take_haply(std::string_view bytes) {
  plugin::HaplyState s;
  if (plugin::parse_haply(bytes, s) != plugin::HaplySaid::state) return;
  const double* q = s.orientation;
  const double length = std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3]));
  promise(std::fabs(length - 1) < 1e-9 && s.buttons < 8, "a grip has an orientation");
  for (int i = 0; i < 3; ++i)
    promise(std::fabs(s.position[i]) <= 100 && std::fabs(s.velocity[i]) <= 100,
            "a cursor is in range");
}

// Four bytes: the number at which it begins. Then datagrams, each behind two bytes: how many
// commands were sent before it, and its size.
void take_udp_arm(std::string_view bytes) {
  UdpArmSample newest{};
  if (bytes.size() < sizeof newest.number) return;
  std::memcpy(&newest.number, bytes.data(), sizeof newest.number);
  std::uint64_t sent = newest.number, answered = sent;  // these do not wrap
  for (std::size_t at = sizeof newest.number; at + 2 <= bytes.size();) {
    sent += static_cast<std::uint8_t>(bytes[at]);
    const std::size_t size =
        std::min<std::size_t>(static_cast<std::uint8_t>(bytes[at + 1]), bytes.size() - at - 2);
    const std::vector<char> datagram(bytes.begin() + static_cast<long>(at) + 2,
                                     bytes.begin() + static_cast<long>(at + 2 + size));
    at += 2 + size;
    const UdpArmSample before = newest;
    if (!udp_arm_take(datagram.data(), size, static_cast<std::uint32_t>(sent), &newest)) {
      promise(std::memcmp(&before, &newest, sizeof newest) == 0, "what is refused changes nothing");
      continue;
    }
    promise(size == sizeof newest, "a sample has its size");
    promise(newest.mark == UDP_ARM_SAMPLE, "a sample has its mark");
    answered += static_cast<std::uint32_t>(newest.number - before.number);
    promise(answered <= sent, "numbers never go back, and answer what was sent");
  }
}

// The capabilities that a plug-in states.
void take_plugin(std::string_view bytes) {
  h6PluginCapabilities can{};
  if (bytes.empty()) return;
  std::memcpy(&can, bytes.data(), std::min(bytes.size(), sizeof can));
  if (!device::nonsense_in(can).empty()) return;
  promise(std::strlen(can.name) < sizeof can.name, "a name ends");
  for (const double rating :
       {can.max_force, can.max_torque, can.max_velocity, can.rate, can.freeze_time})
    promise(rating >= 0 && rating <= 1e9, "a rating is a number");
}

void take_gz(std::string_view bytes) {
  const auto text = io::gunzip(bytes, "x.gz");
  if (!text) check_sentence(text.error());
}

void take_request(std::string_view bytes) {
  const auto request = io::view::parse_request(bytes);
  if (!request) return check_sentence(request.error());
  if (const auto* move = std::get_if<io::view::MoveHand>(&*request)) {
    const h6Pose& p = move->pose;
    const double n = std::sqrt(p.q.w * p.q.w + p.q.x * p.q.x + p.q.y * p.q.y + p.q.z * p.q.z);
    promise(std::fabs(p.p.x) <= 1e3 && std::fabs(n - 1) < 1e-9, "a hand has a pose");
  }
}

// One byte: how many vertices the model has. Then what the page for picking them says.
void take_pick(std::string_view bytes) {
  if (bytes.empty()) return;
  const auto count = static_cast<std::uint8_t>(bytes[0]);
  const auto picked = io::view::parse_picked(bytes.substr(1), count);
  if (!picked) return check_sentence(picked.error());
  promise(picked->use == !picked->vertices.empty(), "a choice has vertices");
  for (std::size_t i = 0; i < picked->vertices.size(); ++i)
    promise(
        picked->vertices[i] < (i + 1 < picked->vertices.size() ? picked->vertices[i + 1] : count),
        "vertices rise and are the model's");
}

void read_recording(const std::string& file) {
  const auto recording = io::read_recording(file, {0, 5000});
  if (!recording) return check_sentence(recording.error());
  promise(recording->frames.size() <= recording->frame_count, "no more frames than there are");
  promise(recording->seals.empty() || recording->seals.size() == recording->frames.size(),
          "a seal for each frame");
  promise(recording->bends.size() == recording->frames.size() * io::modes_of(recording->head.bends),
          "a shape for each frame");
  for (const io::RecordedBend& bend : recording->head.bends)
    promise(bend.modes >= 1 && bend.modes <= H6_MAX_MODES, "a body bends by its modes");
}
void take_recording(std::string_view bytes) { read_recording(as_file(bytes, "r.h5")); }
std::string sealed_log(std::string_view bytes) {
  std::string log(bytes);
  for (std::size_t at = 0; at + sizeof(io::recording::LogRecord) <= log.size();) {
    constexpr std::size_t skip = offsetof(io::recording::LogRecord, kind);
    io::recording::LogRecord record;
    std::memcpy(&record, &log[at], sizeof record);
    if (record.bytes > log.size() - at - sizeof record) break;
    const std::size_t end = at + sizeof record + record.bytes;
    record.checksum = static_cast<std::uint32_t>(
        crc32_z(0, reinterpret_cast<const Bytef*>(&log[at + skip]), end - at - skip));
    std::memcpy(&log[at], &record, sizeof record);
    at = end;
  }
  return log;
}
void take_log(std::string_view bytes) {
  const std::string log = as_file(sealed_log(bytes), "l.h5.part");
  const std::string file = log.substr(0, log.size() - 5);
  std::error_code ignored;
  fs::remove(file, ignored);
  read_recording(file);
  fs::remove(file, ignored);
}

constexpr Target kTargets[] = {{"stl", take_mesh<kStl>},    {"obj", take_mesh<kObj>},
                               {"ply", take_mesh<kPly>},    {"gltf", take_mesh<kGltf>},
                               {"glb", take_mesh<kGlb>},    {"dae", take_mesh<kDae>},
                               {"mesh_gz", take_mesh<kGz>}, {"gz", take_gz},
                               {"shell", take_shell},       {"field", take_field},
                               {"vdb", take_vdb},           {"scene", take_scene},
                               {"path", take_path},         {"script", take_script},
                               {"device", take_spec},       {"hid", take_hid},
                               {"bridge", take_bridge},     {"haply", take_haply},
                               {"plugin", take_plugin},     {"request", take_request},
                               {"pick", take_pick},         {"recording", take_recording},
                               {"log", take_log},           {"contract", take_contract},
                               {"veg", take_solid<kVeg>},   {"msh", take_solid<kMsh>},
                               {"vtk", take_solid<kVtk>},   {"deformable", take_deformable},
                               {"study", take_study},       {"run_text", take_run_text},
                               {"udp_arm", take_udp_arm},   {"http", take_http}};

}  // namespace

std::span<const Target> targets() { return kTargets; }

const Target* find_target(std::string_view name) {
  for (const Target& target : kTargets)
    if (name == target.name) return &target;
  return nullptr;
}

void broken(const char* promise) {
  std::fprintf(stderr, "a promise is broken: %s\n", promise);
  std::abort();
}

std::string as_file(std::string_view bytes, const char* name) {
  struct Folder {
    fs::path path;
    Folder() {
      std::string made =
          fs::is_directory("/dev/shm") ? "/dev/shm/hapsix-fuzz-XXXXXX" : "/tmp/hapsix-fuzz-XXXXXX";
      if (!mkdtemp(made.data())) broken("there is a folder for files");
      path = made;
    }
    ~Folder() {
      std::error_code ignored;
      fs::remove_all(path, ignored);
    }
  };
  static const Folder folder;
  const std::string file = folder.path / name;
  const int fd = ::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  const ssize_t wrote = fd < 0 ? -1 : ::write(fd, bytes.data(), bytes.size());
  ::close(fd);
  promise(wrote == static_cast<ssize_t>(bytes.size()), "there is room for files");
  return file;
}

}  // namespace h6::fuzz
