// SPDX-License-Identifier: Apache-2.0
// hapsix_peer.cpp - the engine itself, and its scalar reference on every point.
#include "bench/peers/peer.h"
#include "hapsix/vector.h"
#include "kernels/field/sample_field.h"
#include "runtime/model/model.h"

namespace h6::peers {
namespace {

struct SessionDeleter {
  void operator()(h6Session* s) const { h6DestroySession(s); }
};

// One whole step of the engine with its default rule: the body is placed, contacts are found and
// weighed, forces, coupling and motion follow.
class Engine : public Peer {
 public:
  explicit Engine(const Task& task) : points_(task.points) {
    const io::LoadedScene& scene = *task.scene;
    h6BodyDef bodies[2] = {h6DefaultBodyDef(), h6DefaultBodyDef()};
    bodies[0].fixed = true, bodies[0].field = scene.bodies[0].field;
    bodies[1] = scene.bodies[1];
    h6HandDef hand = h6DefaultHandDef();
    hand.body = 1;
    h6SessionDef def = h6DefaultSessionDef();
    def.bodies = bodies, def.body_count = 2;
    def.hands = &hand, def.hand_count = 1;
    def.contact.stiffness = scene.scene.contact.stiffness;
    def.threads = 1;
    def.max_contacts = task.points.size();
    session_.reset(h6CreateSession(scene.model.get(), &def, nullptr));
    if (!session_) throw std::bad_alloc();
    row_of_.resize(task.points.size());
    for (std::size_t i = 0; i < task.order.size(); ++i) row_of_[task.order[i]] = i;
  }
  const char* name() const override { return "hapsix, whole step"; }
  bool on_field() const override { return true; }
  void meet(const h6Pose& pose) override {
    pose_ = pose;
    const h6BodyState state{pose, {}};
    h6DeviceSample sample{};
    sample.pose = pose;
    h6SetBody(session_.get(), 1, &state);
    h6Step(session_.get(), &sample, nullptr);
  }
  double search_seconds() const override {
    const h6FrameReport report = h6GetFrame(session_.get());
    return 1e-6 * (report.stage_us[H6_STAGE_TRAVERSE] + report.stage_us[H6_STAGE_CONTACTS]);
  }
  void contacts(std::vector<Contact>& all) const override {
    all.clear();
    const h6Contacts c = h6GetContacts(session_.get(), 1);
    for (std::size_t i = 0; i < c.count; ++i)
      if (c.depth[i] > 0)
        all.push_back({place(pose_, points_[row_of_[c.point[i]]]),
                       {c.gx[i], c.gy[i], c.gz[i]},
                       static_cast<double>(c.depth[i])});
  }
  const std::vector<std::uint32_t>* inside() const override {
    inside_.clear();
    const h6Contacts c = h6GetContacts(session_.get(), 1);
    for (std::size_t i = 0; i < c.count; ++i)
      if (c.depth[i] > 0) inside_.push_back(static_cast<std::uint32_t>(row_of_[c.point[i]]));
    return &inside_;
  }

 private:
  const std::vector<h6Vec3>& points_;
  std::vector<std::size_t> row_of_;
  std::unique_ptr<h6Session, SessionDeleter> session_;
  h6Pose pose_{};
  mutable std::vector<std::uint32_t> inside_;
};

// The scalar specification of our sampler on every point, in the engine's own layout of the field.
class Reference : public Peer {
 public:
  explicit Reference(const Task& task) : points_(task.points) {
    const auto field = static_cast<std::size_t>(task.scene->bodies[0].field);
    field_ = &task.scene->model->fields[field];
    for (const h6Vec3& p : points_)
      x_.push_back(float(p.x)), y_.push_back(float(p.y)), z_.push_back(float(p.z));
    distance_.resize(points_.size());
  }
  const char* name() const override { return "our reference, every point"; }
  bool on_field() const override { return true; }
  void meet(const h6Pose& pose) override {
    pose_ = pose;
    const kernels::PointsView points{x_.data(), y_.data(), z_.data(), x_.size()};
    const kernels::Affine to_field = way_to_field(pose);
    kernels::sample_field_ref(field_->view, to_field, points, nullptr, x_.size(), distance_.data(),
                              nullptr, nullptr, nullptr);
    inside_.clear();
    for (std::size_t i = 0; i < x_.size(); ++i)
      if (distance_[i] < 0) inside_.push_back(static_cast<std::uint32_t>(i));
    const std::size_t n = inside_.size();
    depth_.resize(n), gx_.resize(n), gy_.resize(n), gz_.resize(n);
    kernels::sample_field_ref(field_->view, to_field, points, inside_.data(), n, depth_.data(),
                              gx_.data(), gy_.data(), gz_.data());
  }
  void contacts(std::vector<Contact>& all) const override {
    all.clear();
    for (std::size_t i = 0; i < inside_.size(); ++i)
      all.push_back({place(pose_, points_[inside_[i]]),
                     unit(h6Vec3{double(gx_[i]), double(gy_[i]), double(gz_[i])}),
                     -field_->voxel * double(depth_[i])});
  }
  const std::vector<std::uint32_t>* inside() const override { return &inside_; }

 private:
  kernels::Affine way_to_field(const h6Pose& pose) const {
    const h6Vec3 axis[3] = {rotate(pose.q, {1, 0, 0}), rotate(pose.q, {0, 1, 0}),
                            rotate(pose.q, {0, 0, 1})};
    kernels::Affine out;
    for (int row = 0; row < 3; ++row) {
      for (int k = 0; k < 3; ++k)
        out.m[row][k] = static_cast<float>(component(axis[k], row) / field_->voxel);
      out.m[row][3] =
          static_cast<float>((component(pose.p, row) - field_->origin[row]) / field_->voxel);
    }
    return out;
  }

  const std::vector<h6Vec3>& points_;
  const Field* field_;
  std::vector<float> x_, y_, z_, distance_, depth_, gx_, gy_, gz_;
  std::vector<std::uint32_t> inside_;
  h6Pose pose_{};
};

}  // namespace

std::unique_ptr<Peer> make_engine(const Task& task) { return std::make_unique<Engine>(task); }
std::unique_ptr<Peer> make_reference(const Task& task) { return std::make_unique<Reference>(task); }

}  // namespace h6::peers
