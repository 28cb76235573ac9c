// SPDX-License-Identifier: Apache-2.0
// peer.h - one way to find the contacts of a part with an obstacle, as the comparison asks for it.
//
// Every peer gets the same meshes and the same poses, works on one thread and finds all contacts of
// each pose. Peers of triangles get the part's mesh, peers of points its shell. What a peer builds
// once, it builds when it is made. `meet` is timed; it stores what it finds in the peer's own form.
// `contacts` is not timed: it puts that into one form.
#pragma once
#include <memory>
#include <vector>

#include "bench/peers/tasks.h"

namespace h6::peers {

// In the obstacle's frame [m]. `push` is the unit direction that leads the part out of the
// obstacle, `depth` > 0 how far, as the peer says.
struct Contact {
  h6Vec3 place, push;
  double depth;
};

class Peer {
 public:
  virtual ~Peer() = default;
  virtual const char* name() const = 0;
  // Whether its surface is the field's, with the offset of a soup, or that of the triangles.
  virtual bool on_field() const = 0;
  // Part -> obstacle.
  virtual void meet(const h6Pose& pose) = 0;
  virtual void contacts(std::vector<Contact>& all) const = 0;
  // Peers of points: the numbers of those inside, in task.points. Null: it has triangles.
  virtual const std::vector<std::uint32_t>* inside() const { return nullptr; }
  // The engine weighs contacts, finds forces and moves bodies, which no other peer does: the share
  // of the last `meet` that is the search for contacts [s]. Negative: all of it.
  virtual double search_seconds() const { return -1; }
};

// hapsix_peer.cpp
std::unique_ptr<Peer> make_engine(const Task& task);
std::unique_ptr<Peer> make_reference(const Task& task);  // our scalar sampler, point by point
// grid_peers.cpp: every point of the shell is sampled
std::unique_ptr<Peer> make_openvdb(const Task& task);
std::unique_ptr<Peer> make_nanovdb(const Task& task);
// Other files of that name
std::unique_ptr<Peer> make_embree(const Task& task);
std::unique_ptr<Peer> make_ode(const Task& task);
std::unique_ptr<Peer> make_fcl(const Task& task);
std::unique_ptr<Peer> make_bullet(const Task& task);

}  // namespace h6::peers
