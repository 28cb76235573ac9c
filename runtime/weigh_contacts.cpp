// weigh_contacts.cpp - how the contact stiffness is shared among a shell body's contacts.
//
// Xu & Barbic 2016, Eq. (6)-(12), McNeely 1999 for `global`; `robust` is ours. METHOD.md, Sec. 3, says
// which of the paper's ambiguities are settled how: w_i = phi_self / phi_i.
#include <algorithm>
#include <cmath>

#include "kernels/gauss_weights.h"
#include "runtime/stages.h"

namespace h6 {
namespace {

constexpr std::size_t kSlice = 128;         // rows of the density sum at a time
constexpr std::size_t kWorthSharing = 256;  // contacts from which the helper is asked
constexpr float kFacingEdge = 0.25f;        // N.g from which a contact counts in full

// A contact whose normal opposes the field's gradient would pull the body in.
void facing(Contacts& c, bool filter) {
  for (std::size_t i = 0; i < c.count; ++i) {
    const float dot = c.nx[i] * c.gx[i] + c.ny[i] * c.gy[i] + c.nz[i] * c.gz[i];
    c.facing[i] = filter ? std::clamp(dot / kFacingEdge, 0.0f, 1.0f) : 1.0f;
  }
}

// T = (r x N) / sqrt(|r x N|^2 + l0^2): Eq. (10), with l0 against blow-up where r is parallel to N.
void torque_directions(Contacts& c, float l0) {
  for (std::size_t i = 0; i < c.count; ++i) {
    const float x = c.ry[i] * c.nz[i] - c.rz[i] * c.ny[i];
    const float y = c.rz[i] * c.nx[i] - c.rx[i] * c.nz[i];
    const float z = c.rx[i] * c.ny[i] - c.ry[i] * c.nx[i];
    const float length = std::sqrt(x * x + y * y + z * z + l0 * l0);
    const float scale = length > 0 ? 1.0f / length : 0.0f;
    c.tx[i] = x * scale;
    c.ty[i] = y * scale;
    c.tz[i] = z * scale;
  }
}

struct Rule {
  bool gauss = false, facing = false, depth = false;
  kernels::Hat hat = kernels::Hat::normal;
  kernels::GaussWidths widths{};
  float l0 = 0;
};

Rule rule_of(const h6ContactDef& def, double voxel) {
  Rule rule;
  rule.facing = def.pieces & H6_PIECE_FACING;
  rule.depth = def.pieces & H6_PIECE_DEPTH;
  rule.l0 = static_cast<float>(def.torque_length);
  rule.widths = {static_cast<float>(def.epsilon), static_cast<float>(def.epsilon)};
  switch (def.method) {
    case H6_METHOD_GAUSS3:
      rule.gauss = true;
      break;
    case H6_METHOD_GAUSS6:
      rule.gauss = true;
      rule.hat = def.pieces & H6_PIECE_PRODUCT ? kernels::Hat::product : kernels::Hat::sum;
      break;
    case H6_METHOD_ROBUST:
      rule = {true,
              true,
              true,
              kernels::Hat::product,
              {static_cast<float>(def.epsilon_normal), static_cast<float>(def.epsilon_torque)},
              static_cast<float>(def.torque_length > 0 ? def.torque_length : voxel)};
      break;
    default:
      break;
  }
  return rule;
}

}  // namespace

void weigh_contacts(h6Session& s, std::int32_t shell_body) {
  Contacts& c = s.contacts[shell_body];
  if (c.count == 0) return;
  const Rule rule = rule_of(s.contact, s.bodies[shell_body].voxel);
  facing(c, rule.facing);
  torque_directions(c, rule.l0);
  if (!rule.gauss) {
    const double n0 = s.contact.global_n0;
    const double n = static_cast<double>(c.count);
    const float w =
        s.contact.method == H6_METHOD_GLOBAL && n > n0 ? static_cast<float>(n0 / n) : 1.0f;
    for (std::size_t i = 0; i < c.count; ++i) c.weight[i] = w * c.facing[i];
    return;
  }
  const kernels::DirectionsView view{c.nx,
                                     c.ny,
                                     c.nz,
                                     c.tx,
                                     c.ty,
                                     c.tz,
                                     rule.facing ? c.facing : nullptr,
                                     rule.depth ? c.depth : nullptr,
                                     c.count};
  if (c.count < kWorthSharing) {
    kernels::gauss_weights(view, rule.hat, rule.widths, 0, c.count, c.weight);
    return;
  }
  const std::size_t slices = (c.count + kSlice - 1) / kSlice;
  s.team->for_slices(slices, [&](std::size_t i) {
    kernels::gauss_weights(view, rule.hat, rule.widths, i * kSlice,
                           std::min((i + 1) * kSlice, c.count), c.weight);
  });
}

}  // namespace h6
