// SPDX-License-Identifier: Apache-2.0
// envelope.h - one message to the page: a head in JSON and arrays of numbers in binary.
//
//   u32 bytes of JSON | JSON, padded with blanks to 4 | arrays, each padded with zeros to 4
//
// The JSON has `kind` and `arrays`: [{"name", "type": "f32" | "u32" | "i16" | "u8", "count"}], in
// the order of the arrays. Numbers are little-endian. io/view/page/src/envelope.ts reads it.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "hapsix/types.h"

namespace h6::io::view {

using Message = std::shared_ptr<const std::string>;  // shared by all clients, never changed

// Appends a pose as x y z, w x y z, the columns of poses in every message.
void append_pose(std::vector<float>& to, const h6Pose& p);

class Envelope {
 public:
  Envelope();
  ~Envelope();
  Envelope(const Envelope&) = delete;
  Envelope& operator=(const Envelope&) = delete;

  void add(const std::string& name, const std::vector<float>& values);
  void add(const std::string& name, const std::vector<std::uint32_t>& values);
  void add(const std::string& name, const std::vector<std::int16_t>& values);
  void add(const std::string& name, const std::vector<std::uint8_t>& values);
  // Writes `arrays` into `head` from what was added.
  std::string pack(nlohmann::ordered_json head) const;
  Message message(nlohmann::ordered_json head) const;

 private:
  void append(const std::string& name, const char* type, const void* data, std::size_t count,
              std::size_t bytes);
  std::unique_ptr<nlohmann::ordered_json> arrays_;
  std::string payload_;
};

}  // namespace h6::io::view
