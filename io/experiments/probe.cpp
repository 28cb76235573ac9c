// SPDX-License-Identifier: Apache-2.0
#include "io/experiments/probe.h"

#include <numbers>

#include "io/experiments/vary_scene.h"

namespace h6::cli {

io::Scene posed_scene(const std::string& name, io::Mesh obstacle, io::PointCloud points) {
  io::Scene scene = io::common_scene(name, name);
  scene.bodies.push_back(io::obstacle("obstacle", std::move(obstacle), kProbeVoxel));
  io::SceneBody body;
  body.name = "body";
  body.com = h6Vec3{0, 0, 0};
  body.inertia = io::box_inertia(body.mass, {10 * kMm, 10 * kMm, 5 * kMm});
  body.pose = {{0, 0, 0}, {1, 0, 0, 0}};
  body.shell.emplace();
  body.shell->points = std::move(points);
  body.shell->bake.levels = 3;
  scene.bodies.push_back(std::move(body));
  return scene;
}

io::Scene turned_scene(const std::string& name, io::Mesh obstacle, io::PointCloud points) {
  io::Scene scene = posed_scene(name, std::move(obstacle), std::move(points));
  turn_lattice(scene.bodies[0], turn_by({0.37, 0.61, 0.23}));
  return scene;
}

io::Mesh ridge() {
  const io::Mesh upright = io::prism_mesh({0, 0, 0}, 4 * kMm, -40 * kMm, 40 * kMm, 256);
  const h6Quat lie = turn_by({0, std::numbers::pi / 2, 0});
  return io::moved(upright, {{0, 0, -4 * kMm}, lie});
}

io::Mesh plate(double from_x, double to_x) {
  return io::box_mesh({from_x, -40 * kMm, -12 * kMm}, {to_x, 40 * kMm, 0});
}

io::PointCloud bottom(int nu, int nv) {
  io::PointCloud cloud;
  io::add_face(cloud, {0, 0, -5 * kMm}, {10 * kMm, 0, 0}, {0, 10 * kMm, 0}, nu, nv, {0, 0, 1});
  return cloud;
}

Probe::Probe(const io::LoadedScene& loaded, const MethodColumn& method) {
  h6SessionDef def = loaded.session_def();
  method.apply(def.contact);
  def.contact.damping = 0;
  def.max_contacts = 200000;
  session_.reset(h6CreateSession(loaded.model.get(), &def, nullptr));
}

h6Contacts Probe::at(const h6Pose& pose) {
  const h6BodyState state{pose, {}};
  h6SetBody(session_.get(), 1, &state);
  h6DeviceSample sample{};
  h6DeviceCommand command{};
  h6Step(session_.get(), &sample, &command);
  return h6GetContacts(session_.get(), 1);
}

}  // namespace h6::cli
