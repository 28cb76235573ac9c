// SPDX-License-Identifier: Apache-2.0
// vdb_tree.h - the tree of an uncompressed float grid as it stands in an OpenVDB file (versions 222
// and later), so that its leaves can be written and read by many threads, each where it belongs.
//
// First the topology: 1 tree, then background, number of tiles and of children of the root; for
// each child its place and an internal node of 32^3, in it the nodes of 16^3, in these the masks of
// the leaves. Then the buffers: a record a leaf. Children stand by x, then y, then z. A field has
// at most 2048 nodes on a side, so all of it lies in one child of the root, at (0, 0, 0).
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "io/field/field_data.h"

namespace h6::io {

inline constexpr std::size_t kLeafRecord = 64 + 1 + 512 * sizeof(float);  // mask, how, values

struct VdbLeaf {
  std::array<std::uint8_t, 3> brick;  // its place
  std::uint32_t row;                  // in the samples
};

// The used bricks of a field in the order of the file.
std::vector<VdbLeaf> leaves_of(const FieldData& field);
// Every value of a leaf is active. Outside of leaves stands plus or minus the band, inactive.
std::string vdb_topology(const FieldData& field, const std::vector<VdbLeaf>& leaves);
// One without any leaf.
std::string empty_vdb_topology(float background);
// The leaves of a topology as written above, rows in the order of cells (x fastest): all bytes of
// it are looked at; false where it is any other.
bool read_topology(std::span<const char> bytes, std::vector<VdbLeaf>& leaves);

// To and from a record; samples are 512, x fastest. Reading: false where a value is not active or
// not finite.
void write_leaf(const float* samples, char* record);
bool read_leaf(const char* record, float* samples);

}  // namespace h6::io
