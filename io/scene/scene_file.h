// SPDX-License-Identifier: Apache-2.0
// scene_file.h - scene files (JSON, version 1) and hand paths (CSV).
#pragma once
#include "io/scene/scene.h"

namespace h6::io {

// Whatever is wrong is told in one sentence with file and place: no such file, not JSON (line and
// column), an unknown or missing key (its path, "bodies[1].shell.voxels", and the nearest known
// key), a value of the wrong kind or out of range, a body that does not exist, a bad path row (file
// and line). Relative files are looked for beside the scene file. Paths are read; meshes must
// exist.
Result<Scene> read_scene(const std::filesystem::path& file);

// CSV `t,x,y,z,qw,qx,qy,qz`, lengths in `unit`; a header line, blank lines and # comments are
// skipped. Quaternions within 0.001 of unit length are normalised, others are an error.
Result<Path> read_path(const std::filesystem::path& file, Unit unit);
Outcome write_path(const std::filesystem::path& file, const Path& path, Unit unit);

// Writes folder/scene.json and the files it names: STL meshes and CSV paths in scene.unit, PLY
// shells (built from the scene's points) in metres. Files that the scene was read from are copied.
// The folder is made where needed. Reading the result gives the same scene.
Outcome export_scene(const Scene& scene, const std::filesystem::path& folder);

// The same JSON as text, for the head of a recording. No file is written; files keep the names they
// were read by.
std::string scene_text(const Scene& scene);
// Reads such a text. It touches no file, and paths of hands stay empty. A scene in metres comes
// back to the bit. `name` stands in error sentences.
Result<Scene> read_scene_text(const std::string& text, const std::string& name);

// A JSON schema of scene files, as text.
std::string scene_schema();
// The page runtime/SETTINGS.md: every setting of scene files and of the engine.
std::string settings_page();

}  // namespace h6::io
