// SPDX-License-Identifier: Apache-2.0
// file_seal.h - a checksum of a whole file inside that file.
//
// The file holds seal_text() once, near its start, where its format keeps text; its digits are a
// hash of all bytes, taken with the digits as zeros: of the hashes of its blocks, so that blocks
// can be hashed in any order, by several threads, while they are written or read. Readers of
// formats that trust their input look at the seal before they parse.
#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "hapsix/result.h"
#include "io/file/content_hash.h"

namespace h6::io {

inline constexpr std::size_t kSealBlock = std::size_t{4} << 20;  // bytes; the last one is shorter

std::string seal_text();  // a mark and 32 zeros
Outcome seal_file(const std::filesystem::path& file);

enum class Seal { whole, broken, none };  // none: somebody else's file
Result<Seal> check_seal(const std::filesystem::path& file);

// The same of a file that passes by block by block.
class BlockSeals {
 public:
  explicit BlockSeals(std::uint64_t file_size)
      : hashes_((file_size + kSealBlock - 1) / kSealBlock) {}
  std::size_t blocks() const { return hashes_.size(); }
  // Bytes of block i; the first block holds the mark. Each block once; any thread.
  void add(std::size_t i, std::span<const char> bytes);
  // With all blocks added: puts the digits into the first block; false where it has no mark.
  bool put_digits(std::span<char> first) const;
  Seal check(std::span<const char> first) const;

 private:
  std::vector<Hash128> hashes_;
};

}  // namespace h6::io
