// SPDX-License-Identifier: Apache-2.0
// scene_file.h - reads and writes scene files (JSON, version 1) and hand paths (CSV).
#pragma once
#include "io/scene/scene.h"

namespace h6::io {

// Reads a scene file and the hand paths it names. It does not read the meshes, but they must exist.
// Relative file names start at the folder of the scene file. A scene may come from a stranger, so
// its files must lie below that folder, unless `outside`. An error is one sentence that names the
// file and the place: line and column where the text is not JSON, the path of the key
// ("bodies[1].shell.voxels") where a key or value is wrong, the line of a bad path row. For an
// unknown key it also names the nearest known key.
Result<Scene> read_scene(const std::filesystem::path& file, bool outside = false);
// Whether `file` lies below the folder of `scene`, symbolic links followed.
bool lies_below(const std::filesystem::path& file, const std::filesystem::path& scene);

// The CSV columns are `t,x,y,z,qw,qx,qy,qz`, with time in seconds and lengths in `unit`. The reader
// skips a header line, blank lines and # comments. It normalises quaternions within 0.001 of unit
// length; others are an error.
Result<Path> read_path(const std::filesystem::path& file, Unit unit);
Outcome write_path(const std::filesystem::path& file, const Path& path, Unit unit);

// Writes folder/scene.json and the files it names: STL meshes and CSV paths in scene.unit, and PLY
// shells of the scene's points in metres. It copies the files that the scene was read from, and
// creates the folder if needed. Reading the result gives the same scene.
Outcome export_scene(const Scene& scene, const std::filesystem::path& folder);

// The same JSON as text, for the head of a recording. It writes no file and keeps the file names of
// the scene.
std::string scene_text(const Scene& scene);
// Reads the result of scene_text. It opens no file, so the paths of hands stay empty. A scene in
// metres comes back bit for bit. Error sentences call the text `name`.
Result<Scene> read_scene_text(const std::string& text, const std::string& name);

// The JSON schema of scene files, as text.
std::string scene_schema();
// The text of runtime/SETTINGS.md: every setting of scene files and of the engine.
std::string settings_page();

}  // namespace h6::io
