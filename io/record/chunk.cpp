// SPDX-License-Identifier: Apache-2.0
#include "io/record/chunk.h"

#include <zlib.h>

#include <new>

namespace h6::io::recording {

void shuffle(const std::vector<std::byte>& from, std::size_t cell, std::vector<std::byte>& to) {
  to.resize(from.size());
  const std::size_t cells = from.size() / cell;
  for (std::size_t k = 0; k < cell; ++k)
    for (std::size_t i = 0; i < cells; ++i) to[k * cells + i] = from[i * cell + k];
}

void unshuffle(const std::vector<std::byte>& from, std::size_t cell, std::vector<std::byte>& to) {
  to.resize(from.size());
  const std::size_t cells = from.size() / cell;
  for (std::size_t k = 0; k < cell; ++k)
    for (std::size_t i = 0; i < cells; ++i) to[i * cell + k] = from[k * cells + i];
}

std::size_t deflate(const std::vector<std::byte>& from, std::vector<std::byte>& out) {
  const std::size_t at = out.size();
  uLongf size = compressBound(from.size());
  out.resize(at + size);
  if (compress2(reinterpret_cast<Bytef*>(out.data() + at), &size,
                reinterpret_cast<const Bytef*>(from.data()), from.size(), deflate_level) != Z_OK)
    throw std::bad_alloc();  // the only failure with room enough
  out.resize(at + size);
  return size;
}

bool inflate(const std::byte* from, std::size_t bytes, std::vector<std::byte>& to) {
  uLongf size = to.size();
  return uncompress(reinterpret_cast<Bytef*>(to.data()), &size,
                    reinterpret_cast<const Bytef*>(from), bytes) == Z_OK &&
         size == to.size();
}

}  // namespace h6::io::recording
