// SPDX-License-Identifier: Apache-2.0
// exact.h - what is true at a pose: the depth of the deepest point of the part's shell and the
// direction that leads out, from the triangles in double.
#pragma once
#include "bench/peers/peer.h"

namespace h6::peers {

// Of all contacts of a pose: the greatest depth [m], and the unit sum of depth times push; zero
// where there is none.
struct Summary {
  std::size_t contacts = 0;
  double deepest = 0;
  h6Vec3 push{};
};
Summary sum_up(const std::vector<Contact>& contacts);

class Exact {
 public:
  explicit Exact(const Task& task);
  // `inside` are the points inside the field's surface, with their distances there [m]. Of a soup,
  // the field's surface is its offset outside the triangles: then both are known.
  struct Truth {
    Summary on_field, on_triangles;
  };
  Truth at(const h6Pose& pose, const std::vector<std::uint32_t>& inside,
           const std::vector<Contact>& sampled) const;

 private:
  const Task& task_;
  std::unique_ptr<io::RayScene> rays_;
};

}  // namespace h6::peers
