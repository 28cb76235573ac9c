// SPDX-License-Identifier: Apache-2.0
#include "io/mesh/gltf_data.h"

#include <algorithm>
#include <cstring>
#include <limits>

#include "io/file/text_scan.h"

namespace h6::io {
namespace {

using nlohmann::json;

// Whether an extension leaves the triangles alone: it describes appearance, or integer coordinates,
// which are read.
bool harmless(const std::string& extension) {
  for (const char* start : {"KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_",
                            "EXT_lights_", "MSFT_texture_", "KHR_mesh_quantization"})
    if (extension.starts_with(start)) return true;
  return false;
}

json parse_json(std::string_view text, const MeshSource& source) {
  try {
    json root = json::parse(text);
    if (!root.is_object()) source.fail("this is JSON but no glTF");
    return root;
  } catch (const json::parse_error& fault) {
    source.fail("byte " + std::to_string(fault.byte),
                "this is no valid JSON; it is damaged, truncated or no glTF");
  } catch (const json::exception&) {
    source.fail("its JSON holds a number that no computer number can hold");
  }
}

template <class T>
T load(const GltfColumn& column, std::uint64_t at) {
  T value;
  std::memcpy(&value, column.bytes.data() + at, sizeof value);
  return value;
}

template <class T>
double scaled(const GltfColumn& column, std::uint64_t at) {
  const double value = load<T>(column, at);
  if (!column.normalized) return value;
  return std::max(-1.0, value / static_cast<double>(std::numeric_limits<T>::max()));
}

}  // namespace

double GltfColumn::real(std::uint64_t row, std::uint64_t axis) const {
  const std::uint64_t start = row * stride;
  switch (type) {
    case 5120:
      return scaled<std::int8_t>(*this, start + axis);
    case 5121:
      return scaled<std::uint8_t>(*this, start + axis);
    case 5122:
      return scaled<std::int16_t>(*this, start + 2 * axis);
    case 5123:
      return scaled<std::uint16_t>(*this, start + 2 * axis);
    case 5125:
      return scaled<std::uint32_t>(*this, start + 4 * axis);
    default:
      return load<float>(*this, start + 4 * axis);
  }
}

std::uint32_t GltfColumn::whole(std::uint64_t row) const {
  const std::uint64_t start = row * stride;
  if (type == 5121) return load<std::uint8_t>(*this, start);
  if (type == 5123) return load<std::uint16_t>(*this, start);
  return load<std::uint32_t>(*this, start);
}

GltfData::GltfData(const MeshSource& source, const GltfContainer& file)
    : source_(source), file_(file), root_(parse_json(file.text, source)) {
  check_version();
}

const GltfData::Json& GltfData::list(const char* key) const {
  static const Json kNone = Json::array();
  const auto found = root_.find(key);
  if (found == root_.end()) return kNone;
  if (!found->is_array()) fail(key, "this must be a list");
  return *found;
}

const GltfData::Json& GltfData::item(const char* key, std::uint64_t index,
                                     const std::string& from) const {
  const Json& all = list(key);
  if (index >= all.size())
    fail(from, "it names " + std::string(key) + " " + std::to_string(index) + ", the file has " +
                   std::to_string(all.size()));
  if (!all[index].is_object()) fail(at(key, index), "this must be an object");
  return all[index];
}

std::string GltfData::at(const char* key, std::uint64_t index) {
  return std::string(key) + " " + std::to_string(index);
}

std::uint64_t GltfData::natural(const Json& value, const std::string& place,
                                const char* key) const {
  if (!value.is_number_unsigned())
    fail(place, "'" + std::string(key) + "' must be a whole number, not below 0");
  return value.get<std::uint64_t>();
}
std::uint64_t GltfData::need(const Json& object, const char* key, const std::string& place) const {
  const auto found = object.find(key);
  if (found == object.end()) fail(place, "'" + std::string(key) + "' is missing");
  return natural(*found, place, key);
}
std::uint64_t GltfData::natural_or(const Json& object, const char* key, std::uint64_t otherwise,
                                   const std::string& place) const {
  const auto found = object.find(key);
  return found == object.end() ? otherwise : natural(*found, place, key);
}

std::string GltfData::name_of(const Json& object) {
  const auto found = object.find("name");
  return found != object.end() && found->is_string()
             ? printable(found->get_ref<const std::string&>())
             : std::string();
}

void GltfData::check_version() const {
  const auto asset = root_.find("asset");
  if (asset == root_.end() || !asset->is_object() || !asset->contains("version") ||
      !(*asset)["version"].is_string())
    source_.fail("it does not say which version of glTF it is ('asset'), so it is none");
  const std::string version = (*asset)["version"];
  if (!version.starts_with("2."))
    source_.fail("this is glTF " + printable(version) + ", only version 2 is read; export it anew");
  for (const Json& extension : list("extensionsRequired")) {
    const std::string name = extension.is_string() ? extension.get<std::string>() : "";
    if (!harmless(name))
      source_.fail("it needs the extension " + io::quoted(name) +
                   ", which is not read; export it without (uncompressed)");
  }
}

std::string_view GltfData::buffer(std::uint64_t index, const std::string& from) {
  const Json& entry = item("buffers", index, from);
  if (const auto known = buffers_.find(index); known != buffers_.end()) return known->second;
  const std::string place = at("buffers", index);
  const std::uint64_t length = need(entry, "byteLength", place);
  const std::string_view bytes = buffer_bytes(entry, index, length, place);
  if (bytes.size() < length)
    fail(place, "it announces " + std::to_string(length) + " bytes, " +
                    std::to_string(bytes.size()) + " are there; it is truncated");
  return buffers_[index] = bytes.substr(0, length);
}

std::string_view GltfData::buffer_bytes(const Json& entry, std::uint64_t index,
                                        std::uint64_t length, const std::string& place) {
  const auto uri = entry.find("uri");
  if (uri == entry.end()) {
    if (index != 0 || !file_.blob) fail(place, "it has neither bytes nor a file");
    return *file_.blob;
  }
  if (!uri->is_string()) fail(place, "'uri' must be text");
  const std::string& text = uri->get_ref<const std::string&>();
  if (text.starts_with("data:")) {
    const std::size_t comma = text.find(',');
    if (comma == std::string::npos || !text.substr(0, comma).ends_with(";base64"))
      fail(place, "its data URI is not base64");
    return keep(decode_base64(std::string_view(text).substr(comma + 1), source_));
  }
  return keep(read_beside(source_, decode_percent(text), length));
}

std::string_view GltfData::keep(std::string&& bytes) {
  owned_.push_back(std::make_unique<std::string>(std::move(bytes)));
  return *owned_.back();
}

GltfColumn GltfData::accessor(std::uint64_t index, const char* type, std::uint64_t width,
                              const std::string& from) {
  const Json& entry = item("accessors", index, from);
  const std::string place = at("accessors", index);
  if (!entry.contains("type") || entry["type"] != type)
    fail(place, "its type must be " + std::string(type) + " here");
  if (entry.contains("sparse")) fail(place, "sparse accessors are not read; export it without");
  if (!entry.contains("bufferView")) fail(place, "it has no 'bufferView', so no data");
  GltfColumn out;
  out.type = need(entry, "componentType", place);
  out.count = need(entry, "count", place);
  out.normalized = entry.contains("normalized") && entry["normalized"] == true;
  const std::uint64_t size = width * component_size(out.type, place);
  const std::uint64_t number = need(entry, "bufferView", place);
  const Json& view = item("bufferViews", number, place);
  const std::string view_place = at("bufferViews", number);
  if (uses(view, "EXT_meshopt_compression"))
    fail(view_place, "it is compressed (EXT_meshopt_compression); export it without");
  const std::string_view all = buffer(need(view, "buffer", view_place), view_place);
  const std::uint64_t begin = natural_or(view, "byteOffset", 0, view_place);
  const std::uint64_t length = need(view, "byteLength", view_place);
  if (begin > all.size() || length > all.size() - begin)
    fail(view_place, "it reaches beyond its buffer");
  out.stride = natural_or(view, "byteStride", size, view_place);
  if (out.stride < size || out.stride > 252) fail(view_place, "its 'byteStride' cannot be right");
  const std::uint64_t offset = natural_or(entry, "byteOffset", 0, place);
  if (out.count == 0) return out;
  if (offset > length || length - offset < size ||
      (length - offset - size) / out.stride < out.count - 1)
    fail(place,
         "it has " + std::to_string(out.count) + " elements and reaches beyond its bufferView");
  out.bytes = all.substr(begin + offset, (out.count - 1) * out.stride + size);
  return out;
}

std::uint64_t GltfData::component_size(std::uint64_t type, const std::string& place) const {
  switch (type) {
    case 5120:
    case 5121:
      return 1;
    case 5122:
    case 5123:
      return 2;
    case 5125:
    case 5126:
      return 4;
    default:
      fail(place, "componentType " + std::to_string(type) + " does not exist");
  }
}

bool GltfData::uses(const Json& object, const char* extension) {
  const auto found = object.find("extensions");
  return found != object.end() && found->is_object() && found->contains(extension);
}

}  // namespace h6::io
