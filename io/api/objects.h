// SPDX-License-Identifier: Apache-2.0
// objects.h - what stands behind the handles of hapsix/io.h.
#pragma once
#include "hapsix/io.h"
#include "io/field/field_data.h"
#include "io/mesh/mesh.h"
#include "io/shell/shell_data.h"

struct h6Mesh {
  h6::io::Mesh mesh;
};
struct h6Field {
  h6::io::FieldData data;
};
struct h6Shell {
  h6::io::ShellData data;
};
