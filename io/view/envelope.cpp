// SPDX-License-Identifier: Apache-2.0
#include "io/view/envelope.h"

#include <bit>
#include <cstring>
#include <nlohmann/json.hpp>

namespace h6::io::view {

static_assert(std::endian::native == std::endian::little, "arrays are sent as they are in memory");

void append_pose(std::vector<float>& to, const h6Pose& p) {
  for (const double x : {p.p.x, p.p.y, p.p.z, p.q.w, p.q.x, p.q.y, p.q.z})
    to.push_back(static_cast<float>(x));
}

Envelope::Envelope() : arrays_(std::make_unique<nlohmann::ordered_json>()) {
  *arrays_ = nlohmann::ordered_json::array();
}
Envelope::~Envelope() = default;

void Envelope::append(const std::string& name, const char* type, const void* data,
                      std::size_t count, std::size_t bytes) {
  arrays_->push_back({{"name", name}, {"type", type}, {"count", count}});
  if (bytes > 0) payload_.append(static_cast<const char*>(data), bytes);
  payload_.append((4 - payload_.size() % 4) % 4, '\0');
}

void Envelope::add(const std::string& name, const std::vector<float>& v) {
  append(name, "f32", v.data(), v.size(), v.size() * sizeof v[0]);
}
void Envelope::add(const std::string& name, const std::vector<std::uint32_t>& v) {
  append(name, "u32", v.data(), v.size(), v.size() * sizeof v[0]);
}
void Envelope::add(const std::string& name, const std::vector<std::int16_t>& v) {
  append(name, "i16", v.data(), v.size(), v.size() * sizeof v[0]);
}
void Envelope::add(const std::string& name, const std::vector<std::uint8_t>& v) {
  append(name, "u8", v.data(), v.size(), v.size() * sizeof v[0]);
}

std::string Envelope::pack(nlohmann::ordered_json head) const {
  head["arrays"] = *arrays_;
  // Names come from files, so bytes that are not UTF-8 are replaced.
  std::string text = head.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  text.append((4 - text.size() % 4) % 4, ' ');
  const auto bytes = static_cast<std::uint32_t>(text.size());
  std::string out(sizeof bytes, '\0');
  std::memcpy(out.data(), &bytes, sizeof bytes);
  out.reserve(out.size() + text.size() + payload_.size());
  return out.append(text).append(payload_);
}

Message Envelope::message(nlohmann::ordered_json head) const {
  return std::make_shared<const std::string>(pack(std::move(head)));
}

}  // namespace h6::io::view
