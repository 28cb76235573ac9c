// SPDX-License-Identifier: Apache-2.0
#include "io/view/replayed_contacts.h"

#include "hapsix/vector.h"

namespace h6::io::view {

std::vector<ReplayedContact> replayed_contacts(const LoadedScene& scene, const h6Session* session) {
  std::vector<ReplayedContact> all;
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    const auto body = static_cast<std::int32_t>(b);
    const h6Contacts c = h6GetContacts(session, body);
    if (!c.count) continue;
    // Arms begin at the centre of mass: of a shell that bends, at that of the body it touches.
    const std::int32_t from = scene.bends[b] ? c.field_body[0] : body;
    const h6Vec3 centre =
        place(h6GetBody(session, from).pose, scene.bodies[static_cast<std::size_t>(from)].com);
    for (std::size_t i = 0; i < c.count; ++i) {
      if (!(c.depth[i] > 0)) continue;
      ReportContact r{};
      r.position = {static_cast<float>(centre.x + c.rx[i]), static_cast<float>(centre.y + c.ry[i]),
                    static_cast<float>(centre.z + c.rz[i])};
      r.normal = {c.nx[i], c.ny[i], c.nz[i]};
      r.torque_direction = {c.tx[i], c.ty[i], c.tz[i]};
      r.weight = c.weight[i];
      r.depth = c.depth[i];
      all.push_back({r, b, static_cast<std::size_t>(c.field_body[i]), c.point[i], c.load[i]});
    }
  }
  return all;
}

std::vector<float> replayed_bends(const LoadedScene& scene, const h6Session* session) {
  std::vector<float> all;
  double q[H6_MAX_MODES];
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    const std::size_t r =
        h6GetDeformation(session, static_cast<std::int32_t>(b), q, nullptr, H6_MAX_MODES);
    all.insert(all.end(), q, q + r);
  }
  return all;
}

}  // namespace h6::io::view
