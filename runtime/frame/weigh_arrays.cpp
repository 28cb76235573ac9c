// SPDX-License-Identifier: Apache-2.0
// weigh_arrays.cpp - h6WeighContacts: the weight rules for contacts of any simulator.
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "hapsix/hapsix.h"
#include "runtime/contact/settings.h"
#include "runtime/contact/weighing.h"
#include "runtime/frame/session_checks.h"

namespace h6 {
namespace {

constexpr std::size_t kMostContacts = 1000000;

// The memory that a call needs, in one block.
struct Work {
  Contacts contacts{};
  ClusterScratch cluster{};
  std::uint32_t* source = nullptr;  // (rows) the index of each row's contact, before clustering
  char* scratch = nullptr;          // for weigh_columns, large enough for any rule
};

void lay_out(Work& work, Arena& arena, std::size_t count) {
  take_columns(work.contacts, arena, count);
  work.contacts.cell = nullptr;
  work.cluster = {arena.take<std::uint32_t>(count), arena.take<std::uint32_t>(count),
                  arena.take<std::uint64_t>(count)};
  work.source = arena.take<std::uint32_t>(count);
  h6ContactDef hungriest{};  // the rule that needs most: two trees, even for few contacts
  hungriest.method = H6_METHOD_GAUSS6;
  work.scratch = arena.take<char>(weigh_scratch_bytes(hungriest, count));
}

std::size_t bytes_of(std::size_t count) {
  Work work;
  Arena counting;
  lay_out(work, counting, count);
  return counting.used() + kAlignment;  // the block may start anywhere
}

// Uses the caller's block, or takes one from the heap.
class Block {
 public:
  Block(const h6ContactArrays& in, std::size_t bytes)
      : own_(in.scratch ? nullptr : std::malloc(bytes)), memory_(in.scratch ? in.scratch : own_) {}
  ~Block() { std::free(own_); }
  Block(const Block&) = delete;
  Block& operator=(const Block&) = delete;
  char* aligned() const {
    const auto at = reinterpret_cast<std::uintptr_t>(memory_);
    return static_cast<char*>(memory_) + (kAlignment - at % kAlignment) % kAlignment;
  }
  explicit operator bool() const { return memory_ != nullptr; }

 private:
  void *own_, *memory_;
};

bool finite3(const float* v) {
  return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
}
double length3(const float* v) {
  return std::sqrt(double{v[0]} * v[0] + double{v[1]} * v[1] + double{v[2]} * v[2]);
}

bool check_rows(const h6ContactArrays& in, bool series, double lever, h6Error* error) {
  for (std::size_t i = 0; i < in.count; ++i) {
    const float *n = in.normals + 3 * i, *r = in.arms + 3 * i;
    if (!finite3(n) || !finite3(r) || !std::isfinite(in.depths[i]) ||
        (in.gradients && !finite3(in.gradients + 3 * i)))
      return fail(error, "contact %zu: normal, arm, depth and gradient must be finite", i);
    if (std::fabs(length3(n) - 1) > 1e-3)
      return fail(error, "contact %zu: its normal has length %g, not 1", i, length3(n));
    if (series && length3(r) > 1.001 * lever)
      return fail(error, "contact %zu: its arm of %g m is longer than the lever, %g m", i,
                  length3(r), lever);
  }
  return true;
}

bool check_arrays(const h6ContactDef& def, const h6ContactArrays& in, double voxel, double lever,
                  h6Error* error) {
  if (!check_contact(def, error) || !check_reserved(in, "contacts: ", error)) return false;
  if (in.count > kMostContacts)
    return fail(error, "at most %zu contacts, there are %zu", kMostContacts, in.count);
  if (in.count && (!in.normals || !in.arms || !in.depths))
    return fail(error, "contacts need normals, arms and depths");
  if (!(voxel > 0 && std::isfinite(voxel)) || !(lever > 0 && std::isfinite(lever)))
    return fail(error, "voxel and lever must be above 0 m, they are %g and %g", voxel, lever);
  if (in.form != H6_SYMMETRIC && in.form != H6_EXACT)
    return fail(error, "gradient form %d does not exist", static_cast<int>(in.form));
  if (in.velocity &&
      (!from(in.velocity->linear).allFinite() || !from(in.velocity->angular).allFinite()))
    return fail(error, "the velocity is not finite");
  if (in.scratch && in.scratch_bytes < bytes_of(in.count))
    return fail(error, "scratch has %zu bytes, %zu contacts need %zu", in.scratch_bytes, in.count,
                bytes_of(in.count));
  return check_rows(in, uses_series(def), lever, error);
}

void fill_rows(const h6ContactArrays& in, bool series, Work& work) {
  Contacts& c = work.contacts;
  for (std::size_t i = 0; i < in.count; ++i) {
    if (!(in.depths[i] > 0) && !series) continue;
    const float *n = in.normals + 3 * i, *r = in.arms + 3 * i;
    const float* g = in.gradients ? in.gradients + 3 * i : n;
    const double length = length3(g);
    const float unit = length > 1e-6 ? static_cast<float>(1 / length) : 1.0f;
    if (!(length > 1e-6)) g = n;  // a vanishing gradient has no direction
    const std::size_t row = c.count++;
    c.depth[row] = in.depths[i];
    c.nx[row] = n[0], c.ny[row] = n[1], c.nz[row] = n[2];
    c.gx[row] = g[0] * unit, c.gy[row] = g[1] * unit, c.gz[row] = g[2] * unit;
    c.rx[row] = r[0], c.ry[row] = r[1], c.rz[row] = r[2];
    c.point[row] = work.source[row] = static_cast<std::uint32_t>(i);
    c.field_body[row] = 0;
  }
}

// Gives each contact its weight. A cluster's weight is shared in proportion to depth.
void hand_out_weights(const h6ContactArrays& in, std::size_t rows_before, bool clustered,
                      Work& work, float* weights) {
  std::fill_n(weights, in.count, 0.0f);
  Contacts& c = work.contacts;
  if (!clustered) {
    for (std::size_t row = 0; row < c.count; ++row) weights[c.point[row]] = c.weight[row];
    return;
  }
  float* const sum = c.slack;
  std::fill_n(sum, c.count, 0.0f);
  for (std::size_t i = 0; i < rows_before; ++i)
    if (work.cluster.root[i] != kNoCluster) sum[work.cluster.root[i]] += in.depths[work.source[i]];
  for (std::size_t i = 0; i < rows_before; ++i) {
    const std::uint32_t row = work.cluster.root[i], source = work.source[i];
    if (row != kNoCluster) weights[source] = c.weight[row] * (in.depths[source] / sum[row]);
  }
}

struct Sums {
  Vec6 f = Vec6::Zero();
  Mat6 K = Mat6::Zero(), D = Mat6::Zero();
};

void store_row_major(const Mat6& m, double* out) {
  for (int row = 0; row < 6; ++row)
    for (int col = 0; col < 6; ++col) out[6 * row + col] = m(row, col);
}

Mat6 geometric_term(const Vec6& f) {
  Mat6 m = Mat6::Zero();
  m.topRightCorner<3, 3>() = -cross_matrix(f.head<3>());
  m.bottomRightCorner<3, 3>() = -cross_matrix(f.tail<3>());
  return m;
}

Sums sum_weighted(const Contacts& c, const h6ContactDef& def, const Vec6& u, bool exact) {
  const kernels::WrenchColumns columns{c.depth, c.weight, c.nx, c.ny, c.nz, c.gx,
                                       c.gy,    c.gz,     c.rx, c.ry, c.rz, c.count};
  kernels::WrenchParameters p{def.stiffness, def.damping, {}, exact};
  Vec6::Map(p.velocity) = u;
  const kernels::WrenchSum sum = kernels::contact_wrench(columns, p, 0, c.count);
  Sums out{Vec6::Map(sum.force), -row_major(sum.stiffness), -def.damping * row_major(sum.damping)};
  if (exact) out.K += geometric_term(Vec6::Map(sum.elastic));
  return out;
}

Sums sum_series_weighted(const Contacts& c, const h6ContactDef& def, double lever, bool exact) {
  const kernels::WrenchSum sum = sum_series_rows(c, exact, 0, c.count);
  const Mat6 G = series_spring(def, lever), C = row_major(sum.damping);
  const Mat6 X = def.stiffness * G * (G + C).inverse();
  Sums out{def.stiffness * Vec6::Map(sum.force), -X * row_major(sum.stiffness),
           -def.damping * X * C};
  if (exact) out.K += geometric_term(out.f);
  return out;
}

}  // namespace
}  // namespace h6

using namespace h6;

extern "C" {

size_t h6WeighScratchBytes(size_t count) { return count <= kMostContacts ? bytes_of(count) : 0; }

int h6WeighContacts(const h6ContactDef* given, const h6ContactArrays* contacts, double voxel,
                    double lever, float* weights, h6Wrench* wrench, double* stiffness,
                    double* damping, h6Error* error) {
  if (!given || !contacts) return fail(error, "a contact definition and contacts are needed"), -1;
  const h6ContactArrays& in = *contacts;
  h6ContactDef contact = *given;
  if (contact.stiffness == 0) contact.stiffness = kLeastStiffness;
  if (!check_arrays(contact, in, voxel, lever, error)) return -1;
  const std::size_t bytes = bytes_of(in.count);
  const Block block(in, bytes);
  if (!block) return fail(error, H6_ERROR_MEMORY, "no memory for %zu contacts", in.count), -1;
  Work work;
  Arena arena(block.aligned(), bytes - kAlignment);
  lay_out(work, arena, in.count);

  const bool series = uses_series(contact), exact = in.form == H6_EXACT;
  Vec6 u = Vec6::Zero();
  if (in.velocity) u << from(in.velocity->linear), from(in.velocity->angular);
  Contacts& c = work.contacts;
  fill_rows(in, series, work);
  const std::size_t rows = c.count;
  if (uses_clusters(contact))
    c.count = cluster_contacts(c, 0, rows, 0, contact.cluster_voxels * voxel, work.cluster);
  Sums sums;
  if (series) {
    double y[6] = {};
    if (contact.method == H6_METHOD_FIRM) {
      kernels::push_directions(kernel_columns(c, 0, rows), nullptr, c.nx, c.ny, c.nz, c.facing);
      const float margin = static_cast<float>(contact.margin_voxels * voxel);
      for (std::size_t i = 0; i < rows; ++i) c.slack[i] = c.depth[i] + margin;
      note_firmness(c, contact, voxel, 0, rows);
    }
    fill_inner_stiffness(c, contact, voxel, nullptr, work.scratch);
    fill_series_gap(c, contact.damping, u, 0, rows);
    solve_series(c, contact, voxel, lever, y, nullptr);
    sums = sum_series_weighted(c, contact, lever, exact);
  } else {
    weigh_columns(c, contact, voxel, lever, nullptr, work.scratch);
    sums = sum_weighted(c, contact, u, exact);
  }
  if (weights) hand_out_weights(in, rows, uses_clusters(contact), work, weights);
  if (wrench) *wrench = {to(Vec3(sums.f.head<3>())), to(Vec3(sums.f.tail<3>()))};
  if (stiffness) store_row_major(sums.K, stiffness);
  if (damping) store_row_major(sums.D, damping);
  return 0;
}

}  // extern "C"
