// SPDX-License-Identifier: Apache-2.0
#include "io/view/live_state.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "hapsix/vector.h"
#include "io/view/scene_drawing.h"

namespace h6::io::view {
namespace {

using nlohmann::ordered_json;

// Bins of a quarter octave from 1/4 us on.
std::size_t bin_of(double us, std::size_t bins) {
  if (!(us > 0.25)) return 0;
  return std::min(bins - 1, static_cast<std::size_t>(4 * std::log2(4 * us)));
}

// The width of the method's weight hats.
double epsilon_of(const h6ContactDef& c) {
  return c.method == H6_METHOD_ROBUST ? c.epsilon_normal : c.epsilon;
}

constexpr std::size_t kMaxRows = 64;  // of the strips, in one message

}  // namespace

LiveState::LiveState(const LoadedScene& loaded)
    : loaded_(loaded), frame_bins_(kBins), wake_bins_(kBins) {
  for (const h6BodyDef& body : loaded.bodies) append_pose(poses_, body.pose);
}

void LiveState::settings(const h6ContactDef& contact, const h6CouplingDef& coupling) {
  contact_ = contact;
  coupling_ = coupling;
}

void LiveState::begin() {
  any_ = false;
  last_ = {};
  rows_.clear();
  std::fill(std::begin(late_), std::end(late_), 0u);
  std::fill(frame_bins_.begin(), frame_bins_.end(), 0u);
  std::fill(wake_bins_.begin(), wake_bins_.end(), 0u);
}

void LiveState::rows(const h6FrameRecord* all, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    const h6FrameRecord& r = all[i];
    ++frame_bins_[bin_of(r.report.frame_us, kBins)];
    ++wake_bins_[bin_of(r.wakeup_us, kBins)];
    late_[0] += (r.late & H6_LATE_COMPUTE) != 0;
    late_[1] += (r.late & H6_LATE_WAKEUP) != 0;
    late_[2] += (r.late & H6_LATE_STOLEN) != 0;
    status_ |= r.report.status;
    if (r.command[0].cause != H6_CAUSE_NONE) cause_ = r.command[0].cause;
    const float now[kRow] = {static_cast<float>(r.time),
                             static_cast<float>(r.report.contacts),
                             static_cast<float>(norm(r.command[0].wrench.force)),
                             static_cast<float>(1e3 * norm(r.command[0].wrench.torque)),
                             static_cast<float>(r.report.max_depth_voxels),
                             static_cast<float>(r.report.frame_us)};
    rows_.insert(rows_.end(), now, now + kRow);
  }
  if (!count) return;
  last_ = all[count - 1];
  any_ = true;
}

void LiveState::contacts(const h6LoopView& view) {
  poses_.clear();
  for (std::size_t b = 0; b < view.body_count; ++b) append_pose(poses_, view.bodies[b]);
  for (std::vector<float>* column : {&p_, &n_, &t_, &w_, &d_}) column->clear();
  bends_.assign(view.bends, view.bends + view.bend_count);
  stiffness_ = {};
  deepest_ = {};
  for (std::size_t i = 0; i < view.row_count; ++i) {
    const h6ViewContact& c = view.contacts[i];
    if (!(c.depth > 0)) continue;  // about to touch
    if (c.depth > deepest_.depth) deepest_ = c;
    p_.insert(p_.end(), c.position, c.position + 3);
    n_.insert(n_.end(), c.normal, c.normal + 3);
    t_.insert(t_.end(), c.torque_direction, c.torque_direction + 3);
    w_.push_back(c.weight);
    d_.push_back(c.depth);
    const float* n = c.normal;
    const double k = c.weight * contact_.stiffness;
    const double add[6] = {k * n[0] * n[0], k * n[1] * n[1], k * n[2] * n[2],
                           k * n[0] * n[1], k * n[0] * n[2], k * n[1] * n[2]};
    for (std::size_t a = 0; a < 6; ++a) stiffness_[a] += add[a];
  }
  if (view.row_count)
    for (double& k : stiffness_)
      k *= static_cast<double>(view.contact_count) / static_cast<double>(view.row_count);
}

ordered_json LiveState::contact_json() const {
  std::string method = h6MethodName(contact_.method);
  return {{"method", method},
          {"stiffness", contact_.stiffness},
          {"epsilon", epsilon_of(contact_)},
          {"max_depth_voxels", coupling_.max_depth_voxels},
          {"hand_stiffness", coupling_.stiffness},
          {"max_force", coupling_.max_force}};
}

// The obstacle at the deepest contact, with the triangle of its mesh that is nearest; null where
// nothing touches. A field without its mesh has neither part nor triangle.
ordered_json LiveState::deepest_json() const {
  if (!(deepest_.depth > 0)) return nullptr;
  const auto other = static_cast<std::size_t>(deepest_.field_body);
  ordered_json out{{"with", loaded_.scene.bodies[other].name}, {"part", ""}, {"triangle", -1}};
  const int field = loaded_.bodies[other].field;
  const auto& mesh = loaded_.field_meshes[static_cast<std::size_t>(field)];
  if (!mesh || !mesh->rays() || 7 * other + 6 >= poses_.size()) return out;
  const float* at = &poses_[7 * other];
  const float* p = deepest_.position;
  const h6Vec3 away = h6Vec3{p[0], p[1], p[2]} - h6Vec3{at[0], at[1], at[2]};
  const h6Vec3 place = rotate(conjugate(h6Quat{at[3], at[4], at[5], at[6]}), away);
  const RayScene::Near near = (*mesh->rays())->nearest(place);
  if (near.triangle == RayScene::kNoTriangle) return out;
  out["triangle"] = near.triangle;
  const Mesh& m = mesh->mesh();
  if (!m.part.empty()) out["part"] = m.part_names[static_cast<std::size_t>(m.part[near.triangle])];
  return out;
}

Message LiveState::scene_message(std::vector<std::string>& remarks) const {
  Envelope envelope;
  ordered_json head{{"kind", "scene"}};
  head.update(draw_scene(loaded_, DrawLimits{}, envelope, remarks));
  ordered_json methods = ordered_json::array();
  for (int m = 0; m < H6_METHOD_COUNT; ++m)
    methods.push_back(h6MethodName(static_cast<h6Method>(m)));
  head["methods"] = methods;
  head["rate"] = loaded_.scene.rate;
  head["contact"] = contact_json();
  return envelope.message(std::move(head));
}

Message LiveState::state_message() {
  Envelope envelope;
  // At high rates each row sent has the largest values of several.
  const std::size_t count = rows_.size() / kRow, step = (count + kMaxRows - 1) / kMaxRows;
  std::vector<float> rows;
  for (std::size_t i = 0; i < count; i += step) {
    std::array<float, kRow> row;
    std::copy_n(rows_.begin() + static_cast<std::ptrdiff_t>(kRow * i), kRow, row.begin());
    for (std::size_t k = i + 1; k < std::min(count, i + step); ++k)
      for (std::size_t c = 1; c < kRow; ++c) row[c] = std::max(row[c], rows_[kRow * k + c]);
    rows.insert(rows.end(), row.begin(), row.end());
  }
  rows_.clear();
  const h6FrameRecord& r = last_;
  const bool held = !loaded_.hands.empty();
  const auto body = held ? static_cast<std::size_t>(loaded_.hands[0].body) : 0;
  double lag = 0;
  std::vector<float> hands;
  if (held && any_) {
    // The pose at which the hand would hold the body, in the scene.
    const h6Pose& hand = r.command[0].pose;
    const h6Vec3 wanted = place(hand, loaded_.bodies[body].com);
    const h6Vec3 is = place(r.body[0].pose, loaded_.bodies[body].com);
    lag = norm(wanted - is);
    append_pose(hands, hand);
  }
  envelope.add("poses", poses_);
  envelope.add("hands", hands);
  envelope.add("bends", bends_);
  envelope.add("contact_p", p_);
  envelope.add("contact_n", n_);
  envelope.add("contact_t", t_);
  envelope.add("contact_w", w_);
  envelope.add("contact_d", d_);
  envelope.add("rows", rows);
  envelope.add("frame_bins", frame_bins_);
  envelope.add("wake_bins", wake_bins_);
  ordered_json status = ordered_json::array();
  for (h6Status bit = 1; h6StatusName(bit); bit <<= 1)
    if (status_ & bit) status.push_back(h6StatusName(bit));
  ordered_json head{{"kind", "state"},
                    {"time", r.time},
                    {"contacts", r.report.contacts},
                    {"depth_voxels", r.report.max_depth_voxels},
                    {"force", norm(r.command[0].wrench.force)},
                    {"lag", lag},
                    {"stiffness", stiffness_},
                    {"deepest", deepest_json()},
                    {"contact", contact_json()},
                    {"budget_us", 1e6 / loaded_.scene.rate},
                    {"late", {{"compute", late_[0]}, {"wakeup", late_[1]}, {"stolen", late_[2]}}},
                    {"status", status},
                    {"device", h6DeviceStateName(r.state[0])},
                    {"cause", h6CauseName(cause_)},
                    {"fault", r.report.status & H6_OUTPUT_FAULT ? h6CauseName(r.command[0].cause)
                                                                : h6CauseName(H6_CAUSE_NONE)},
                    {"recording", recording_}};
  status_ = 0;
  cause_ = H6_CAUSE_NONE;
  return envelope.message(std::move(head));
}

Message LiveState::note(const std::string& text) {
  const Envelope envelope;
  return envelope.message({{"kind", "note"}, {"text", text}});
}

Message LiveState::slice_message(const Slice& slice) const {
  const LoadedAsset* asset = nullptr;
  for (const LoadedAsset& a : loaded_.assets)
    if (a.is_field && !asset) asset = &a;
  std::size_t body = 0;
  while (body < loaded_.bodies.size() && loaded_.bodies[body].field != 0) ++body;
  if (!asset || body == loaded_.bodies.size()) return nullptr;
  constexpr std::size_t kSide = 320;
  const auto axis = static_cast<std::size_t>(slice.axis), u = (axis + 1) % 3, v = (axis + 2) % 3;
  const double origin[3] = {asset->origin.x, asset->origin.y, asset->origin.z};
  double size[3];
  for (std::size_t a = 0; a < 3; ++a) size[a] = asset->voxel_size * (asset->nodes[a] - 1);
  const double longest = std::max(size[u], size[v]);
  const auto cells = [&](double side) {
    return std::max<std::size_t>(2, static_cast<std::size_t>(std::lround(kSide * side / longest)));
  };
  const std::size_t width = cells(size[u]), height = cells(size[v]);
  std::vector<double> points, distance(width * height);
  points.reserve(3 * width * height);
  for (std::size_t j = 0; j < height; ++j)
    for (std::size_t i = 0; i < width; ++i) {
      double p[3];
      p[axis] = origin[axis] + slice.at * size[axis];
      p[u] = origin[u] + size[u] * (static_cast<double>(i) + 0.5) / static_cast<double>(width);
      p[v] = origin[v] + size[v] * (static_cast<double>(j) + 0.5) / static_cast<double>(height);
      points.insert(points.end(), p, p + 3);
    }
  h6SampleField(loaded_.model.get(), 0, points.data(), distance.size(), distance.data(), nullptr,
                nullptr);
  std::vector<std::uint8_t> values;
  values.reserve(distance.size());
  for (const double d : distance)
    values.push_back(static_cast<std::uint8_t>(
        std::clamp(std::lround(128 + 2 * d / asset->voxel_size), 0l, 255l)));
  Envelope envelope;
  envelope.add("values", values);
  // The plane in the world, at the body's present pose.
  h6Pose pose = loaded_.bodies[body].pose;
  if (7 * body + 6 < poses_.size()) {
    const float* at = &poses_[7 * body];
    pose = {{at[0], at[1], at[2]}, {at[3], at[4], at[5], at[6]}};
  }
  double corner[3], along_u[3] = {}, along_v[3] = {};
  for (std::size_t a = 0; a < 3; ++a) corner[a] = origin[a];
  corner[axis] += slice.at * size[axis];
  along_u[u] = size[u], along_v[v] = size[v];
  const auto list = [](const h6Vec3& p) { return ordered_json{p.x, p.y, p.z}; };
  return envelope.message({{"kind", "slice"},
                           {"width", width},
                           {"height", height},
                           {"corner", list(place(pose, {corner[0], corner[1], corner[2]}))},
                           {"u", list(rotate(pose.q, {along_u[0], along_u[1], along_u[2]}))},
                           {"v", list(rotate(pose.q, {along_v[0], along_v[1], along_v[2]}))}});
}

}  // namespace h6::io::view
