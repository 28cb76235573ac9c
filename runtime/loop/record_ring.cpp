// SPDX-License-Identifier: Apache-2.0
#include "runtime/loop/record_ring.h"

#include <algorithm>
#include <limits>

namespace h6 {
namespace {

// Reserves `count` empty values; null if there is no memory.
template <class T>
T* fill(Buffer<T>& buffer, const h6Allocator& allocator, std::size_t count) {
  if (!buffer.reserve(allocator, count)) return nullptr;
  std::fill_n(buffer.data, count, T{});
  return buffer.data;
}

}  // namespace

RecordRing::RecordRing(std::size_t records, std::size_t inputs, std::size_t hands,
                       std::size_t modes, const h6Allocator& allocator)
    : hands_(hands),
      each_(std::max<std::size_t>(1, hands)),
      modes_(modes),
      records_(records),
      whole_(fill(record_memory_, allocator, records), records),
      inputs_(fill(input_memory_, allocator, std::max<std::size_t>(1, inputs * each_)),
              inputs * each_) {
  fill(bend_memory_, allocator, std::max<std::size_t>(1, records * modes));
}

void RecordRing::push(const h6FrameRecord& row, const double* bends) {
  // Asked once: the reader may make room at any time, and a record is pushed with its bends or not
  // at all. Its slot is free until then.
  if (!whole_.full()) {
    if (modes_ > 0) std::copy_n(bends, modes_, bend_memory_.data + pushed_ % records_ * modes_);
    whole_.push(row);
    ++pushed_;
    return;
  }
  if (!inputs_.room_for(each_)) {
    ++lost_;
    return;
  }
  ++inputs_only_;
  for (std::size_t h = 0; h < each_; ++h)
    inputs_.push({row.time, row.report.frame, row.settings, row.report.coarse_pairs,
                  row.report.coarse_points, row.command[h].cause, row.command[h].causes,
                  row.hand[h], row.safety_input[h]});
}

// Once inputs are in their ring, the other one stays full until this thread pops. So when no inputs
// are seen first, no record that is seen then comes after inputs; and when some are seen, every
// record of a frame before them can be seen, too.
std::size_t RecordRing::pop(h6FrameRecord* out, double* bends, std::size_t room) {
  for (std::size_t i = 0; i < room; ++i) {
    double* const q = bends ? bends + i * modes_ : nullptr;
    const Input* inputs = inputs_.front();
    const h6FrameRecord* record = whole_.front();
    if (!inputs && !record) return i;
    if (record && (!inputs || record->report.frame < inputs->frame)) {
      pop_whole(out[i], q);
      continue;
    }
    pop_inputs(out[i]);
    if (q) std::fill_n(q, modes_, std::numeric_limits<double>::quiet_NaN());
  }
  return room;
}

void RecordRing::pop_whole(h6FrameRecord& out, double* bends) {
  if (bends) std::copy_n(bend_memory_.data + popped_ % records_ * modes_, modes_, bends);
  ++popped_;
  whole_.pop(&out, 1);
}

void RecordRing::pop_inputs(h6FrameRecord& out) {
  out = {};
  out.inputs_only = 1;
  for (std::size_t h = 0; h < each_; ++h) {
    Input in;
    while (inputs_.pop(&in, 1) == 0) {  // the frame's last entries are on their way
    }
    out.time = in.time;
    out.report.frame = in.frame;
    out.report.coarse_pairs = in.coarse_pairs;
    out.report.coarse_points = in.coarse_points;
    out.settings = in.settings;
    if (hands_ == 0) break;
    out.hand[h] = in.hand;
    out.safety_input[h] = in.safety;
    out.command[h].cause = in.cause;
    out.command[h].causes = in.causes;
    out.command[h].pose.q.w = out.body[h].pose.q.w = 1;
  }
}

}  // namespace h6
