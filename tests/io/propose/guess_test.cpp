// SPDX-License-Identifier: Apache-2.0
// Units and up axes of files that state neither.
#include <doctest/doctest.h>

#include "io/propose/guess.h"
#include "tests/io/bake/field_check.h"

using namespace field_check;
using namespace h6::io;

namespace {

Unit unit_of(const char* file, double longest) { return guess_unit({file}, longest).unit; }

}  // namespace

TEST_CASE("numbers that would be too small in millimetres are metres, others are millimetres") {
  CHECK(unit_of("gear.obj", 0.12) == Unit::m);
  CHECK(unit_of("rover.obj", 3.9) == Unit::m);
  CHECK(unit_of("screw.obj", 14.6) == Unit::mm);
  CHECK(unit_of("shell.stl", 176) == Unit::mm);
}

TEST_CASE("a unit in the name of any file decides, as a word of its own only") {
  CHECK(unit_of("part_mm.stl", 0.1) == Unit::mm);
  CHECK(unit_of("counter.unitsmm.STL", 0.1) == Unit::mm);
  CHECK(unit_of("bay-cm.stl.gz", 300) == Unit::cm);
  CHECK(unit_of("plate (inch).obj", 300) == Unit::in);
  CHECK(unit_of("hammer.stl", 0.1) == Unit::m);     // "mm" inside a word
  CHECK(unit_of("peg_16mm.stl", 0.05) == Unit::m);  // a size of the part
  CHECK(guess_unit({"a.stl", "b_cm.stl"}, 0.1).unit == Unit::cm);
}

TEST_CASE("z is up unless the mesh stands on a flat face across y, or the format says y") {
  const Mesh plate_on_z = box({0, 0, 0}, {10, 10, 1}), plate_on_y = box({0, 0, 0}, {10, 1, 10});
  CHECK(guess_up("a.stl", plate_on_z).up == UpAxis::z);
  CHECK(guess_up("a.stl", plate_on_y).up == UpAxis::y);
  CHECK(guess_up("a.stl", box({0, 0, 0}, {10, 10, 10})).up == UpAxis::z);
  CHECK(guess_up("a.stl", turned(plate_on_z, 0.7, 0.4)).up == UpAxis::z);  // no face tells
  CHECK(guess_up("a.GLB", plate_on_z).up == UpAxis::y);
}
