// SPDX-License-Identifier: Apache-2.0
#include "device/spacemouse_report.h"

#include <algorithm>
#include <iterator>

namespace h6::device {
namespace {

constexpr std::uint8_t kTranslation = 0x01, kRotation = 0x02, kButtons = 0x03, kBattery = 0x17;

std::int16_t count_at(const std::uint8_t* bytes) {
  const int value = static_cast<std::int16_t>(static_cast<std::uint16_t>(bytes[0]) |
                                              static_cast<std::uint16_t>(bytes[1]) << 8);
  return static_cast<std::int16_t>(std::clamp(value, -kSpaceMouseFull, kSpaceMouseFull));
}

void take_axes(const std::uint8_t* bytes, std::size_t first, std::size_t count,
               SpaceMouseState& state) {
  for (std::size_t i = 0; i < count; ++i) state.axis[first + i] = count_at(bytes + 2 * i);
}

template <std::size_t N>
bool among(const std::uint16_t (&list)[N], std::uint16_t product) {
  return std::find(std::begin(list), std::end(list), product) != std::end(list);
}

// Bits of the input reports 1 and 2.
struct InputBits {
  std::uint64_t translation = 0, rotation = 0;
  bool whole = false;  // the descriptor was read to its end
};

InputBits input_bits(std::span<const std::uint8_t> d) {
  struct Globals {
    std::uint32_t size = 0, count = 0, id = 0;
  } now, stack[8];
  std::size_t depth = 0;
  InputBits bits;
  for (std::size_t at = 0; at < d.size();) {
    const std::uint8_t prefix = d[at];
    if (prefix == 0xfe) {  // a long item: its length stands in the next byte
      if (at + 1 >= d.size()) return bits;
      at += 3 + d[at + 1];
      if (at > d.size()) return bits;
      continue;
    }
    const std::size_t bytes = (prefix & 3) == 3 ? 4 : prefix & 3;
    if (at + bytes >= d.size() && bytes > 0) return bits;
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < bytes; ++i)
      value |= static_cast<std::uint32_t>(d[at + 1 + i]) << (8 * i);
    switch (prefix & 0xfc) {
      case 0x74:
        now.size = value;
        break;
      case 0x94:
        now.count = value;
        break;
      case 0x84:
        now.id = value;
        break;
      case 0xa4:  // push
        if (depth == std::size(stack)) return bits;
        stack[depth++] = now;
        break;
      case 0xb4:  // pop
        if (depth == 0) return bits;
        now = stack[--depth];
        break;
      case 0x80:  // input
        if (now.size > 4096 || now.count > 4096) return bits;
        if (now.id == kTranslation) bits.translation += std::uint64_t{now.size} * now.count;
        if (now.id == kRotation) bits.rotation += std::uint64_t{now.size} * now.count;
        break;
      default:
        break;
    }
    at += 1 + bytes;
  }
  bits.whole = !d.empty();
  return bits;
}

}  // namespace

ReportLayout layout_of_descriptor(std::span<const std::uint8_t> descriptor) {
  const InputBits bits = input_bits(descriptor);
  if (!bits.whole) return ReportLayout::unknown;
  if (bits.translation >= 6 * 16) return ReportLayout::joint;
  if (bits.translation >= 3 * 16 && bits.rotation >= 3 * 16) return ReportLayout::split;
  return ReportLayout::unknown;
}

ReportKind take_report(std::span<const std::uint8_t> report, ReportLayout layout,
                       SpaceMouseState& state) {
  if (report.size() < 2) return ReportKind::ignored;
  const std::uint8_t* body = report.data() + 1;
  const std::size_t bytes = report.size() - 1;
  switch (report[0]) {
    case kTranslation:
      if (layout == ReportLayout::unknown)
        layout = bytes >= 12 ? ReportLayout::joint : ReportLayout::split;
      if (bytes < (layout == ReportLayout::joint ? 12u : 6u)) return ReportKind::ignored;
      take_axes(body, 0, layout == ReportLayout::joint ? 6 : 3, state);
      return ReportKind::motion;
    case kRotation:
      if (layout == ReportLayout::joint || bytes < 6) return ReportKind::ignored;
      take_axes(body, 3, 3, state);
      return ReportKind::motion;
    case kButtons: {
      std::uint32_t buttons = 0;
      for (std::size_t i = 0; i < std::min<std::size_t>(bytes, 4); ++i)
        buttons |= static_cast<std::uint32_t>(body[i]) << (8 * i);
      state.buttons = buttons;
      return ReportKind::buttons;
    }
    case kBattery:
      if (body[0] > 100) return ReportKind::ignored;
      state.battery = body[0];
      state.charging = bytes >= 2 && body[1] == 1;
      return ReportKind::battery;
    default:
      return ReportKind::ignored;
  }
}

bool is_spacemouse(std::uint16_t vendor, std::uint16_t product, std::uint16_t usage_page,
                   std::uint16_t usage) {
  constexpr std::uint16_t kLogitech = 0x046d, k3Dconnexion = 0x256f;
  static constexpr std::uint16_t logitech[] = {0xc603, 0xc605, 0xc606, 0xc621, 0xc623, 0xc625,
                                               0xc626, 0xc627, 0xc628, 0xc629, 0xc62b};
  static constexpr std::uint16_t own[] = {0xc62e, 0xc62f, 0xc631, 0xc632, 0xc633,
                                          0xc635, 0xc636, 0xc638, 0xc63a, 0xc652};
  // CadMouse, its receivers, keyboards and number pads.
  static constexpr std::uint16_t never[] = {0xc650, 0xc651, 0xc654, 0xc655, 0xc656, 0xc657,
                                            0xc658, 0xc664, 0xc665, 0xc668, 0xc669};
  const bool known = vendor == kLogitech      ? among(logitech, product)
                     : vendor == k3Dconnexion ? among(own, product)
                                              : false;
  if (usage_page == 0 && usage == 0) return known;
  if (usage_page != 0x01 || usage != 0x08) return false;
  return known || (vendor == k3Dconnexion && !among(never, product));
}

}  // namespace h6::device
