// SPDX-License-Identifier: Apache-2.0
#include "io/cli/replayed_contacts.h"

namespace h6::cli {

std::vector<ReplayedContact> replayed_contacts(const RecordedSession& s) {
  std::vector<ReplayedContact> all;
  const auto& loaded = s.loaded();
  for (std::size_t b = 0; b < loaded.bodies.size(); ++b) {
    const auto body = static_cast<std::int32_t>(b);
    const h6Contacts c = h6GetContacts(s.session(), body);
    if (!c.count) continue;
    const h6BodyState state = h6GetBody(s.session(), body);
    const h6Quat& q = state.pose.q;
    // Contact arms start at the centre of mass.
    const double m[3] = {loaded.bodies[b].com.x, loaded.bodies[b].com.y, loaded.bodies[b].com.z};
    const double u[3] = {q.x, q.y, q.z}, p[3] = {state.pose.p.x, state.pose.p.y, state.pose.p.z};
    double centre[3];
    for (int a = 0; a < 3; ++a) {
      const int i = (a + 1) % 3, j = (a + 2) % 3;
      const auto cross = [&](int k) {
        const int l = (k + 1) % 3, n = (k + 2) % 3;
        return u[l] * m[n] - u[n] * m[l];
      };
      centre[a] = p[a] + m[a] + 2 * (q.w * cross(a) + u[i] * cross(j) - u[j] * cross(i));
    }
    for (std::size_t i = 0; i < c.count; ++i) {
      if (!(c.depth[i] > 0)) continue;
      io::view::ReportContact r{};
      r.position = {static_cast<float>(centre[0] + c.rx[i]),
                    static_cast<float>(centre[1] + c.ry[i]),
                    static_cast<float>(centre[2] + c.rz[i])};
      r.normal = {c.nx[i], c.ny[i], c.nz[i]};
      r.torque_direction = {c.tx[i], c.ty[i], c.tz[i]};
      r.weight = c.weight[i];
      r.depth = c.depth[i];
      all.push_back({r, b, static_cast<std::size_t>(c.field_body[i]), c.point[i], c.load[i]});
    }
  }
  return all;
}

}  // namespace h6::cli
