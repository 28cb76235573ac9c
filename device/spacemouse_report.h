// SPDX-License-Identifier: Apache-2.0
// spacemouse_report.h - parses the reports of a 3Dconnexion cap: bytes in; axes, buttons and
// battery out. Pure functions that open nothing and are safe for any bytes.
//
//   id 0x01  7 bytes   x y z            int16, little-endian         split layout
//   id 0x02  7 bytes   rx ry rz
//   id 0x01  13 bytes  x y z rx ry rz                                 joint layout
//   id 0x03            buttons, one bit each, up to 32
//   id 0x04  output    LED: 0 off, 1 on
//   id 0x17            battery: percent, and on some models 1 while it charges
//
// The report descriptor gives a device's layout. Without a descriptor the length of a report gives
// it, never the product.
#pragma once
#include <array>
#include <cstdint>
#include <span>

namespace h6::device {

// The largest deflection that descriptors state; caps exceed it by a few counts.
inline constexpr int kSpaceMouseFull = 350;

struct SpaceMouseState {
  // x y z rx ry rz, counts in -350 .. 350. The device's frame: x to the right, y towards the user,
  // z down; turns about these axes are right-handed.
  std::array<std::int16_t, 6> axis{};
  std::uint32_t buttons = 0;
  int battery = -1;  // [percent]; -1: not known
  bool charging = false;
  bool operator==(const SpaceMouseState&) const = default;
};

enum class ReportLayout { unknown, split, joint };

// Layout from a HID report descriptor (HID 1.11, Sec. 6.2.2); unknown when the descriptor is
// damaged or belongs to another kind of device.
ReportLayout layout_of_descriptor(std::span<const std::uint8_t> descriptor);

enum class ReportKind { ignored, motion, buttons, battery };

// Updates `state` from one report. A report that is cut short or not known is ignored and changes
// nothing.
ReportKind take_report(std::span<const std::uint8_t> report, ReportLayout layout,
                       SpaceMouseState& state);

// Whether a HID interface is a cap of six axes. The usage decides (generic desktop 0x01, multi-axis
// controller 0x08), except that mice and keyboards of the same maker never count. Without a usage
// (0, 0: the descriptor could not be read) the known products decide.
bool is_spacemouse(std::uint16_t vendor, std::uint16_t product, std::uint16_t usage_page,
                   std::uint16_t usage);

}  // namespace h6::device
