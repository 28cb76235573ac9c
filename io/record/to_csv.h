// SPDX-License-Identifier: Apache-2.0
// to_csv.h - the frames of a recording as text, for spreadsheets.
#pragma once
#include <string>
#include <vector>

#include "io/record/recording.h"

namespace h6::io {

// One line with the names of all columns, as in /frames: t, hand_pose_x, ...; with more than one
// hand, those of a hand are hand_pose_x_0, hand_pose_x_1, ... Units are those of /frames: SI.
// Bodies that bend have bend_N_q1, ...
std::string csv_head(const RecordingHead& head);
// A line for each frame. Numbers are the shortest that read back to the same bits.
void append_csv(const Recording& piece, std::string& out);

}  // namespace h6::io
