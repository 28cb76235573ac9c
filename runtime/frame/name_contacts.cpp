// SPDX-License-Identifier: Apache-2.0
// name_contacts.cpp - names the part and the triangle that each contact is with, on request.
//
// A field keeps them by brick. A contact's brick is found again from its arm and the pose of the
// last traversal. So the frame itself stores only one matrix per pair, and nothing per contact.
#include "runtime/frame/name_contacts.h"

#include <algorithm>
#include <cmath>

#include "runtime/frame/session.h"

namespace h6 {
namespace {

// The row of the brick that holds a point [voxel], or -1.
std::int32_t brick_of(const kernels::FieldView& field, const float (&at)[3]) {
  std::int32_t brick[3];
  for (int k = 0; k < 3; ++k) {
    if (!(at[k] >= 0 && at[k] <= static_cast<float>(8 * field.size[k]))) return -1;
    brick[k] = std::min(static_cast<std::int32_t>(at[k]) / 8, field.size[k] - 1);
  }
  const std::int32_t entry =
      field.table[(brick[2] * field.size[1] + brick[1]) * field.size[0] + brick[0]];
  return entry < 0 ? -1 : kernels::row_of(entry);
}

void name_rows(const Contacts& c, const Field& field, const Pair& pair, const kernels::Affine& arms,
               std::int32_t* part, std::int32_t* triangle) {
  for (std::size_t i = pair.begin; i < pair.end; ++i) {
    float at[3];
    for (int k = 0; k < 3; ++k) {
      const float* m = arms.m[k];
      at[k] = m[0] * c.rx[i] + (m[1] * c.ry[i] + (m[2] * c.rz[i] + m[3]));
    }
    const NamedPlace name = name_place(field, at);
    if (part) part[i] = name.part;
    if (triangle) triangle[i] = name.triangle;
  }
}

}  // namespace

NamedPlace name_place(const Field& field, const float (&at)[3]) {
  const std::int32_t row = brick_of(field.view, at);
  return {row < 0 || field.part.count == 0 ? -1 : field.part[row],
          row < 0 || field.triangle.count == 0 ? -1 : field.triangle[row]};
}

}  // namespace h6

using namespace h6;

extern "C" void h6NameContacts(const h6Session* session, int32_t shell_body, int32_t* part,
                               int32_t* triangle) {
  if (!session || shell_body < 0 || static_cast<std::size_t>(shell_body) >= session->bodies.size())
    return;
  const h6Session& s = *session;
  const ShellBody* shell = find_shell(s, shell_body);
  if (!shell) return;
  for (const Pair& pair : shell->pairs)
    name_rows(shell->contacts, *s.bodies[pair.b].field, pair, pair.search.arms, part, triangle);
}
