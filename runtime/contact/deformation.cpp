// SPDX-License-Identifier: Apache-2.0
// deformation.cpp - bends the spheres, points and normals of a shell. METHOD.md, Sec. 10.
#include "runtime/contact/deformation.h"

#include <algorithm>
#include <cstring>

#include "kernels/bend/warp_points.h"

namespace h6 {
namespace {

kernels::ModesView view(const Deformation& d, const Column<float>& modes) {
  return {modes.data, static_cast<std::size_t>(d.modes)};
}

void bend_tier(const Deformation& d, const Tier& rest, const Column<float>& modes,
               const std::uint32_t* vectors, std::size_t count, Tier& to) {
  const float* const from[4] = {rest.x.data, rest.y.data, rest.z.data, rest.radius.data};
  float* const out[4] = {to.x.data, to.y.data, to.z.data, to.radius.data};
  const auto bend = d.shell->bend.warps ? kernels::warp_spheres : kernels::bend_spheres;
  bend(view(d, modes), d.bent, from, vectors, count, out);
}

}  // namespace

// A change of u and of the turn w moves a warped point by at most |du| + 1/2 |dw| |u|, since its
// mean rotation changes by at most half as much as w.
double bend_way(const Deformation& d, const double* change) {
  float values[H6_MAX_MODES];
  for (int j = 0; j < d.modes; ++j) values[j] = static_cast<float>(change[j]);
  const Shell& shell = *d.shell;
  const std::size_t vectors = shell.blocks.x.count / kernels::kBendLanes;
  const kernels::ModesView modes = view(d, shell.bend.blocks);
  if (!shell.bend.warps) return kernels::bend_reach(modes, values, vectors);
  const kernels::WarpReach reach =
      kernels::warp_reach(modes, values, shell.blocks.radius.data, vectors);
  return double{reach.shift} + 0.5 * double{reach.turn} * double{d.reach};
}

void follow(Deformation& d, std::span<const Body> bodies) {
  d.about = bodies[static_cast<std::size_t>(d.partner < 0 ? d.body : d.partner)].x;
  float now[H6_MAX_MODES] = {};
  for (int j = 0; j < d.modes; ++j) now[j] = static_cast<float>(d.q[j]);
  if (d.followed && std::memcmp(now, d.bent, sizeof now) == 0) return;
  std::memcpy(d.bent, now, sizeof now);
  d.followed = true;
  const Shell& shell = *d.shell;
  bend_tier(d, shell.blocks, shell.bend.blocks, nullptr, shell.blocks.x.count / kernels::kBendLanes,
            d.blocks);
  d.reach = 0;
  d.reach = static_cast<float>(bend_way(d, d.q));
}

void bend_groups(Deformation& d, const std::uint32_t* blocks, std::size_t count) {
  static_assert(kBlockRows == kGroupRows * kernels::kBendLanes, "a block's groups are one vector");
  bend_tier(d, d.shell->groups, d.shell->bend.groups, blocks, count, d.groups);
}

void bend_points(Deformation& d, const std::uint32_t* groups, std::size_t count) {
  static_assert(kGroupRows == kernels::kBendLanes, "a group's points are one vector");
  const Shell& s = *d.shell;
  const float* const rest[3] = {s.x.data, s.y.data, s.z.data};
  float* const to[9] = {d.x.data,  d.y.data,  d.z.data,  d.ux.data, d.uy.data,
                        d.uz.data, d.wx.data, d.wy.data, d.wz.data};
  const auto bend = s.bend.warps ? kernels::warp_points : kernels::bend_points;
  bend(view(d, s.bend.points), d.bent, rest, groups, count, to);
}

void bend_normals(Deformation& d, const std::uint32_t* groups, std::size_t count) {
  const Shell& s = *d.shell;
  const float* const rest[3] = {s.nx.data, s.ny.data, s.nz.data};
  float* const to[3] = {d.nx.data, d.ny.data, d.nz.data};
  const float* const turn[3] = {d.wx.data, d.wy.data, d.wz.data};
  if (s.bend.warps) return kernels::warp_normals(rest, turn, groups, count, to);
  kernels::bend_normals(view(d, s.bend.normals), d.bent, rest, groups, count, to);
}

}  // namespace h6
