// SPDX-License-Identifier: Apache-2.0
#include "io/cli/tables.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace h6::cli {
namespace {

std::string format(const char* pattern, auto... values) {
  char text[512];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

// The number of late frames as text. In virtual time no frame can be late.
std::string late(const RunSummary& run, std::uint64_t frames) {
  return run.virtual_time ? "-" : std::to_string(frames);
}

// Says where an asset came from.
const char* origin(const io::LoadedScene& scene, const io::LoadedAsset& asset) {
  if (asset.from_cache) return "from the cache";
  const int index = scene.body_index(asset.body);
  if (index < 0) return "made";
  const io::SceneBody& body = scene.scene.bodies[static_cast<std::size_t>(index)];
  const bool file = asset.is_field ? body.field && !body.field->file.empty()
                                   : body.shell && !body.shell->file.empty();
  return file ? "read" : "baked";
}

}  // namespace

std::string table(const std::vector<RunSummary>& runs) {
  int width = 8;
  for (const RunSummary& r : runs) width = std::max(width, static_cast<int>(r.method.size()));
  std::string out =
      format("%-*s verdict   contacts     deepest  force  frame [us]               late frames\n",
             width, "method") +
      format(
          "%-*s            mean   max  [voxel]    [N]     p50     p99     max  own  wake-up  "
          "stolen\n",
          width, "");
  for (const RunSummary& r : runs)
    out += format("%-*s %-9s %6.1f %5u %8.3f %6.2f %7.1f %7.1f %7.1f %4s %8s %7s\n", width,
                  r.method.c_str(), io::verdict_name(r.verdict), r.contacts_mean, r.contacts_max,
                  r.max_depth_voxels, r.max_force, r.frame_us.percentile(50),
                  r.frame_us.percentile(99), r.frame_us.max(), late(r, r.loop.late_compute).c_str(),
                  late(r, r.loop.late_wakeup).c_str(), late(r, r.loop.late_stolen).c_str());
  return out;
}

std::string late_table(const RunSummary& run) {
  const h6LoopReport& r = run.loop;
  const auto row = [](const char* cause, const h6LateHistogram& h) {
    std::string line = format("%-24s", cause);
    std::uint64_t all = 0;
    for (const std::uint64_t n : h.frames) {
      line += format(" %8llu", static_cast<unsigned long long>(n));
      all += n;
    }
    return all ? line + '\n' : std::string();
  };
  std::string rows = row("own work by the clock", r.late_us_compute) +
                     row("wake-up", r.late_us_wakeup) + row("stolen", r.late_us_stolen);
  if (!rows.empty())
    rows =
        "late frames, by how late  < 10 us  < 0.1 ms   < 1 ms  < 10 ms < 0.1 s   longer\n" + rows;
  const auto judged = [&](io::LateCause cause) {
    return static_cast<unsigned long long>(run.late[static_cast<std::size_t>(cause)]);
  };
  if (r.late_compute > 0)
    rows += format(
        "of %llu by the clock, the frames around them say: %llu own work, %llu the machine, %llu "
        "in doubt\n",
        static_cast<unsigned long long>(r.late_compute), judged(io::LateCause::own),
        judged(io::LateCause::machine), judged(io::LateCause::doubt));
  if (r.late_compute + r.late_stolen + r.late_wakeup > 0 && run.host_stole_ms > 0)
    rows +=
        format("the host took %.0f ms of this machine's cores during the run\n", run.host_stole_ms);
  if (r.coarse_frames > 0)
    rows +=
        format("coarse frames: %llu, to end in time; nothing left out was deeper than %.2f voxel\n",
               static_cast<unsigned long long>(r.coarse_frames), run.missed_depth_voxels);
  return rows;
}

std::string depth_strip(const RunSummary& run) {
  static const char* const blocks[] = {" ", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  constexpr int rows = 4;
  const double top = std::max(1.0, run.max_depth_voxels);
  std::string out;
  for (int row = rows - 1; row >= 0; --row) {
    const double low = top * row / rows, high = top * (row + 1) / rows;
    const bool half = low < 0.5 && 0.5 <= high;
    out += format("  %5.2f %s", high, half ? "┤" : "│");
    for (const float depth : run.depth_strip) {
      const double fill = std::clamp((depth - low) / (high - low), 0.0, 1.0);
      const int block = static_cast<int>(std::ceil(8 * fill - 1e-9));
      out += block == 0 && half ? "·" : blocks[block];
    }
    out += half ? "│ 0.5 voxel\n" : "│\n";
  }
  const std::string end = format("%.4g s", run.seconds);
  return out + format("         0 s%*s\n", 57, end.c_str());
}

std::string assets(const io::LoadedScene& scene) {
  std::string out;
  for (const io::LoadedAsset& a : scene.assets) {
    if (!out.empty()) out += '\n';
    if (a.is_field)
      out +=
          format("  field of %-10.80s %d x %d x %d nodes, %zu bricks, voxel %.4g mm, %s in %.2f s",
                 a.body.c_str(), a.nodes[0], a.nodes[1], a.nodes[2], a.bricks, 1e3 * a.voxel_size,
                 origin(scene, a), a.seconds);
    else
      out += format(
          "  shell of %-10.80s %zu points on %d levels, %s in %.2f s%s", a.body.c_str(), a.points,
          a.levels, origin(scene, a), a.seconds,
          a.modes ? format(", bends by %zu modes from %.3g Hz", a.modes, a.lowest_hz).c_str() : "");
  }
  return out;
}

}  // namespace h6::cli
