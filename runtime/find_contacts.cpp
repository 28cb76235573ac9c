// find_contacts.cpp - which points of a shell are inside a field, and what their contacts are.
//
// Xu & Barbic 2016, Sec. 3 after McNeely 1999: breadth first over nested levels; a node whose
// signed distance exceeds its sphere is dropped with all its descendants. METHOD.md, Sec. 6.
#include <algorithm>
#include <cstring>

#include "kernels/cull_spheres.h"
#include "kernels/sample_field.h"
#include "runtime/stages.h"

namespace h6 {
namespace {

constexpr std::size_t kSlice = 2048;         // rows of a frontier culled at a time
constexpr std::size_t kWorthSharing = 8192;  // rows from which the helper is asked

// Shell coordinates (relative to its centre, metres) to voxels of the field: made in double.
kernels::Affine shell_to_field(const Body& a, const Shell& shell, const Body& b,
                               const Field& field) {
  const Mat3 m = b.R.transpose() * a.R / field.voxel;
  const Vec3 b_mesh = b.x - b.R * b.com;  // origin of b's mesh frame in the world
  const Vec3 centre = a.x + a.R * (shell.centre - a.com);
  const Vec3 t = (b.R.transpose() * (centre - b_mesh) - field.origin) / field.voxel;
  kernels::Affine affine;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) affine.m[r][c] = static_cast<float>(m(r, c));
    affine.m[r][3] = static_cast<float>(t[r]);
  }
  return affine;
}

// `series` needs the points that are about to touch. [voxel]
float margin_of(const h6Session& s) {
  return s.contact.method == H6_METHOD_SERIES ? static_cast<float>(s.contact.margin_voxels) : 0.0f;
}

// Is the distance there a sample? Far from the surface it is only a bound, and no gap can be told.
bool is_sampled(const kernels::FieldView& field, const kernels::Affine& to_field, float x, float y,
                float z) {
  std::int32_t brick[3];
  for (int k = 0; k < 3; ++k) {
    const float* m = to_field.m[k];
    const float q = m[0] * x + (m[1] * y + (m[2] * z + m[3]));
    if (!(q >= 0 && q <= static_cast<float>(8 * field.size[k] - 1))) return false;
    brick[k] = std::min(static_cast<std::int32_t>(q), 8 * field.size[k] - 2) / 8;
  }
  return field.table[(brick[2] * field.size[1] + brick[1]) * field.size[0] + brick[0]] >= 0;
}

struct Cull {
  const kernels::FieldView& field;
  kernels::Affine affine;
  kernels::SpheresView spheres;
  float scale;
  bool wide;
  float margin;  // [voxel]

  std::size_t operator()(const std::uint32_t* rows, std::uint32_t first, std::size_t count,
                         std::uint32_t* out, float* distance) const {
    return kernels::cull_spheres(field, affine, spheres, scale, wide, margin, rows, first, count,
                                 out, distance);
  }
};

// Rows that may touch, in order, whatever runs the slices.
std::size_t cull(h6Session& s, const Cull& cull, const std::uint32_t* rows, std::uint32_t first,
                 std::size_t count, std::uint32_t* out, float* distance) {
  if (count < kWorthSharing || s.team->threads() == 1)
    return cull(rows, first, count, out, distance);
  const std::size_t slices = (count + kSlice - 1) / kSlice;
  s.team->for_slices(slices, [&](std::size_t i) {
    const std::size_t at = i * kSlice, n = std::min(kSlice, count - at);
    s.slice_count[i] = cull(rows ? rows + at : nullptr, first + static_cast<std::uint32_t>(at), n,
                            out + at, distance ? distance + at : nullptr);
  });
  std::size_t kept = s.slice_count[0];
  for (std::size_t i = 1; i < slices; ++i) {
    std::memmove(out + kept, out + i * kSlice, s.slice_count[i] * sizeof *out);
    if (distance)
      std::memmove(distance + kept, distance + i * kSlice, s.slice_count[i] * sizeof *distance);
    kept += s.slice_count[i];
  }
  return kept;
}

std::size_t expand(const Shell& shell, const std::uint32_t* nodes, std::size_t count,
                   std::uint32_t* out) {
  std::size_t n = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t child = shell.first_child[nodes[i]],
                        end = child + shell.child_count[nodes[i]];
    for (std::uint32_t c = child; c < end; ++c) out[n++] = c;
  }
  return n;
}

// Candidates of one pair go behind `used`; returns how many there are.
std::size_t traverse_pair(h6Session& s, const Pair& pair, std::size_t used) {
  const Body &a = s.bodies[pair.a], &b = s.bodies[pair.b];
  const Shell& shell = s.model->shells[a.shell];
  const Field& field = s.model->fields[b.field];
  const float margin = margin_of(s);
  const Cull test{field.view,
                  shell_to_field(a, shell, b, field),
                  {shell.x.data, shell.y.data, shell.z.data, shell.node_radius.data, shell.nodes},
                  static_cast<float>(1.0 / field.voxel),
                  // The short form of culling is proved up to half a voxel of margin.
                  field.wide || margin > 0.5f,
                  margin};
  const std::uint32_t* rows = nullptr;  // the whole first level
  std::size_t count = shell.level_first[1];
  for (std::uint32_t level = 0; level + 1 < shell.levels && count; ++level) {
    const std::size_t kept = cull(s, test, rows, 0, count, s.survivors, nullptr);
    count = expand(shell, s.survivors, kept, s.frontier);
    rows = s.frontier;
  }
  return cull(s, test, rows, 0, count, s.candidate + used, s.candidate_distance + used);
}

// Keeps the `most` deepest of `count` candidates, in their order. Ties go to the first.
std::size_t keep_deepest(h6Session& s, std::size_t count, std::size_t most, Pair* pairs,
                         std::size_t pair_count) {
  std::copy_n(s.candidate_distance, count, s.scratch_depth);
  std::nth_element(s.scratch_depth, s.scratch_depth + (most - 1), s.scratch_depth + count);
  const float limit = s.scratch_depth[most - 1];
  std::size_t below = 0;
  for (std::size_t i = 0; i < count; ++i) below += s.candidate_distance[i] < limit;
  std::size_t ties = most - below, n = 0;
  for (std::size_t p = 0; p < pair_count; ++p) {
    const std::size_t first = n;
    for (std::size_t i = pairs[p].first; i < pairs[p].first + pairs[p].candidates; ++i) {
      const float d = s.candidate_distance[i];
      if (d > limit || (d == limit && ties == 0)) continue;
      ties -= d == limit;
      s.candidate[n] = s.candidate[i];
      s.candidate_distance[n++] = d;
    }
    pairs[p].candidates = n - first;
    pairs[p].first = first;
  }
  return n;
}

}  // namespace

void traverse(h6Session& s, std::size_t first_pair, std::size_t end_pair) {
  const std::size_t most = s.contacts[s.pairs[first_pair].a].capacity;
  std::size_t used = 0;
  for (std::size_t p = first_pair; p < end_pair; ++p) {
    Pair& pair = s.pairs[p];
    pair.first = used;
    pair.candidates = traverse_pair(s, pair, used);
    used += pair.candidates;
    if (used > most) {
      used = keep_deepest(s, used, most, s.pairs + first_pair, p + 1 - first_pair);
      s.report.status |= H6_CONTACTS_DROPPED;
    }
  }
}

void gather_contacts(h6Session& s, std::size_t first_pair, std::size_t end_pair) {
  Contacts& c = s.contacts[s.pairs[first_pair].a];
  c.count = 0;
  for (std::size_t p = first_pair; p < end_pair; ++p) {
    Pair& pair = s.pairs[p];
    const Body &a = s.bodies[pair.a], &b = s.bodies[pair.b];
    const Shell& shell = s.model->shells[a.shell];
    const Field& field = s.model->fields[b.field];
    const std::uint32_t* rows = s.candidate + pair.first;
    const kernels::Affine to_field = shell_to_field(a, shell, b, field);
    const float margin = margin_of(s);
    kernels::sample_field(field.view, to_field,
                          {shell.x.data, shell.y.data, shell.z.data, shell.nodes}, rows,
                          pair.candidates, s.candidate_distance + pair.first, s.gradient_x,
                          s.gradient_y, s.gradient_z);
    const Eigen::Matrix3f Ra = a.R.cast<float>(), Rb = b.R.cast<float>();
    const Eigen::Vector3f arm0 = (a.R * (shell.centre - a.com)).cast<float>();
    const float voxel = static_cast<float>(field.voxel);
    pair.begin = c.count;
    for (std::size_t k = 0; k < pair.candidates; ++k) {
      const float d = s.candidate_distance[pair.first + k];
      // Exactly on the surface: no depth, no force.
      if (!(d < 0) && !(d < margin)) continue;
      const std::uint32_t row = rows[k], point = shell.node_point[row];
      if (!(d < 0) && !is_sampled(field.view, to_field, shell.x[row], shell.y[row], shell.z[row]))
        continue;
      const Eigen::Vector3f n =
          Ra * Eigen::Vector3f(shell.nx[point], shell.ny[point], shell.nz[point]);
      Eigen::Vector3f g = Rb * Eigen::Vector3f(s.gradient_x[k], s.gradient_y[k], s.gradient_z[k]);
      const float length = g.norm();
      // Where the gradient vanishes (a medial sheet) it has no direction: take the point's own.
      g = length > 1e-6f ? Eigen::Vector3f(g / length) : n;
      const Eigen::Vector3f r =
          Ra * Eigen::Vector3f(shell.x[row], shell.y[row], shell.z[row]) + arm0;
      const std::size_t i = c.count++;
      c.depth[i] = -d * voxel;
      c.nx[i] = n.x();
      c.ny[i] = n.y();
      c.nz[i] = n.z();
      c.gx[i] = g.x();
      c.gy[i] = g.y();
      c.gz[i] = g.z();
      c.rx[i] = r.x();
      c.ry[i] = r.y();
      c.rz[i] = r.z();
      c.point[i] = point;
      c.field_body[i] = pair.b;
    }
    pair.end = c.count;
  }
}

}  // namespace h6
