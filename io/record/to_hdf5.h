// SPDX-License-Identifier: Apache-2.0
// to_hdf5.h - turns the log of a run into an HDF5 file. Private.
#pragma once
#include <filesystem>

#include "hapsix/result.h"
#include "io/record/layout.h"
#include "io/record/log.h"

namespace h6::io::recording {

// Writes the log's rows, events and summary as a new HDF5 file `out`, without a torn end. The
// memory used does not grow with the number of rows. Takes the library's lock.
Outcome write_hdf5(const File& log, const std::filesystem::path& out);

// Writes the groups, datasets and attributes of a recording without frames and events.
bool put_empty(hid_t file, const RecordingHead& head, const std::string& summary);

// Turns the log beside `file` into `file`: written aside, then renamed, then the log is removed. An
// older file is replaced or, with `keep_older`, gets the name FILE.before (.before-2, ...), which
// `kept` tells. After a failure the log and an older file are there as before.
Outcome publish(const File& log, const std::filesystem::path& file, bool keep_older,
                std::filesystem::path* kept = nullptr);

}  // namespace h6::io::recording
