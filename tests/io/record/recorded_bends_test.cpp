// SPDX-License-Identifier: Apache-2.0
// q of bodies that bend, in a recording: written, read, compared, refused.
#include <cmath>
#include <functional>
#include <limits>

#include "io/record/seal.h"
#include "io/record/to_csv.h"
#include "tests/io/record/recorded_frames.h"

using namespace h6;
using namespace h6::recorded;

namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// Body 1 has three modes, body 4 one.
RecordingHead bending() {
  RecordingHead h = head();
  h.bends = {{1, "Brücke", 3}, {4, "clip", 1}};
  return h;
}

// q of all bodies in frames first .. first + count: arbitrary bits, NaN included.
std::vector<double> shapes(std::uint64_t first, std::size_t count) {
  std::vector<double> q(4 * count);
  for (std::size_t k = 0; k < q.size(); ++k) {
    const std::uint64_t value = bits(first + k / 4, 900 + k % 4);
    std::memcpy(&q[k], &value, 8);
  }
  return q;
}

bool same_numbers(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), 8 * a.size()) == 0;
}

void record_bends(const fs::path& file, std::size_t count, const RecordingHead& h = bending()) {
  auto recorder = start(file, h);
  REQUIRE(recorder->frames(frames(0, count).data(), count, shapes(0, count).data()));
  REQUIRE(recorder->finish("{}"));
}

std::string edited(const Folder& folder, const std::function<void(hid_t)>& edit) {
  const fs::path file = folder / "edited.h5";
  fs::copy_file(folder / "run.h5", file, fs::copy_options::overwrite_existing);
  const hid_t h5 = H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  edit(h5);
  H5Fclose(h5);
  const std::string said = refusal(file);
  CHECK(said.find('\n') == std::string::npos);
  return said;
}

void replace(hid_t h5, hid_t type, std::vector<hsize_t> dims) {
  H5Ldelete(h5, "/frames/bend_1", H5P_DEFAULT);
  const hid_t space = H5Screate_simple(static_cast<int>(dims.size()), dims.data(), nullptr);
  H5Dclose(H5Dcreate2(h5, "/frames/bend_1", type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  H5Sclose(space);
}

}  // namespace

TEST_CASE("q of every body that bends comes back to the bit, whole, in part and from a log") {
  const Folder folder;
  {
    auto recorder = start(folder / "run.h5", bending());
    for (std::uint64_t at = 0; at < 900; at += 90)  // chunks have 250 rows
      REQUIRE(recorder->frames(frames(at, 90).data(), 90, shapes(at, 90).data()));
    REQUIRE(recorder->frames(nullptr, 0));
    CHECK(same_numbers(read(folder / "run.h5.part").bends, shapes(0, 750)));
  }
  const Recording all = read(folder / "run.h5");
  CHECK(same_numbers(all.bends, shapes(0, 900)));
  REQUIRE(all.head.bends.size() == 2);
  CHECK(all.head.bends[0].body == 1);
  CHECK(all.head.bends[0].name == "Brücke");
  CHECK(all.head.bends[1].modes == 1);
  CHECK(is_prefix(all));
  const Result<Recording> part = read_recording(folder / "run.h5", {260, 100});
  REQUIRE(part);
  CHECK(same_numbers(part->bends, shapes(260, 100)));
}

TEST_CASE("each body that bends has a dataset with its unit and name, and only such a body") {
  const Folder folder;
  record_bends(folder / "run.h5", 300);
  record(folder / "rigid.h5", 300);
  using Shape = std::vector<hsize_t>;
  CHECK(plain_shape(folder / "run.h5", "/frames/bend_1") == Shape{300, 3});
  CHECK(plain_shape(folder / "run.h5", "/frames/bend_4") == Shape{300, 1});
  for (const std::string& column : read(folder / "rigid.h5").columns)
    CHECK_FALSE(column.starts_with("bend"));
  CHECK(read(folder / "rigid.h5").bends.empty());
  const hid_t h5 = H5Fopen((folder / "run.h5").c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  for (const char* attribute : {"units", "columns", "body"})
    CHECK(H5Aexists_by_name(h5, "/frames/bend_1", attribute, H5P_DEFAULT) > 0);
  H5Fclose(h5);
}

TEST_CASE("rows that are recorded without shapes have NaN there") {
  const Folder folder;
  auto recorder = start(folder / "run.h5", bending());
  REQUIRE(add(*recorder, frames(0, 10)));
  REQUIRE(recorder->frames(frames(10, 5).data(), 5, shapes(10, 5).data()));
  REQUIRE(recorder->finish("{}"));
  const Recording r = read(folder / "run.h5");
  REQUIRE(r.bends.size() == 60);
  for (std::size_t k = 0; k < 40; ++k) CHECK(std::isnan(r.bends[k]));
  CHECK(same_numbers({r.bends.begin() + 40, r.bends.end()}, shapes(10, 5)));
}

TEST_CASE("a seal covers q, so a number that is changed in the file shows") {
  const RecordingHead h = bending();
  std::vector<double> q = shapes(0, 1);
  const std::uint64_t seal = RowSeal(h).next(frame(0), q.data());
  CHECK(RowSeal(h).next(frame(0), q.data()) == seal);
  for (double& number : q) {
    const double before = number;
    number = number == 1 ? 2 : 1;
    CHECK(RowSeal(h).next(frame(0), q.data()) != seal);
    number = before;
  }
}

TEST_CASE("a comparison names the coordinate that differs, and leaves out what is not known") {
  RecordingHead h = bending();
  const RowComparison compared(h, {"t", "bend_1", "bend_4"});
  const h6FrameRecord row = frame(3);
  const double q[] = {1, 2, 3, 4};
  CHECK_FALSE(compared.first(row, q, row, q));
  for (std::size_t k = 0; k < 4; ++k) {
    double other[] = {1, 2, 3, 4};
    other[k] += 1e-9;
    const auto found = compared.first(row, q, row, other);
    REQUIRE(found);
    CHECK(found->column == (k < 3 ? "bend_1" : "bend_4"));
    CHECK(found->cell == "q" + std::to_string(k % 3 + 1));
    CHECK(found->a == q[k]);
    CHECK(found->b == other[k]);
  }
  const double unknown[] = {kUnknown, kUnknown, kUnknown, 4};
  CHECK_FALSE(compared.first(row, unknown, row, q));
  CHECK(compared.first(row, q, row, unknown));
  CHECK_FALSE(RowComparison(h, {"t"}).first(row, q, row, unknown));  // the file has no q
}

TEST_CASE("a table as text has a column for each coordinate") {
  const Folder folder;
  record_bends(folder / "run.h5", 2);
  const Recording r = read(folder / "run.h5");
  CHECK(csv_head(r.head).ends_with(",bend_1_q1,bend_1_q2,bend_1_q3,bend_4_q1\n"));
  Recording plain = r;
  plain.bends = {0.5, -1, 2, 3, 0.25, kUnknown, 1, 0};
  std::string text;
  append_csv(plain, text);
  CHECK(text.find(",0.5,-1,2,3\n") != std::string::npos);
  CHECK(text.ends_with(",0.25,nan,1,0\n"));
}

TEST_CASE("datasets of q that are missing, cut off or of another size are refused in a sentence") {
  const Folder folder;
  record_bends(folder / "run.h5", 300);
  CHECK(edited(folder, [](hid_t) {}).empty());
  const auto drop = [](hid_t h5) { H5Ldelete(h5, "/frames/bend_4", H5P_DEFAULT); };
  CHECK(mentions(edited(folder, drop), "/frames/bend_4 is missing"));
  const auto extent = [](hid_t h5, hsize_t rows, hsize_t modes) {
    const hid_t data = H5Dopen2(h5, "/frames/bend_1", H5P_DEFAULT);
    const hsize_t dims[] = {rows, modes};
    REQUIRE(H5Dset_extent(data, dims) >= 0);
    H5Dclose(data);
  };
  CHECK(mentions(edited(folder, [&](hid_t h5) { extent(h5, 299, 3); }), "299 rows"));
  CHECK(mentions(edited(folder, [&](hid_t h5) { extent(h5, hsize_t{1} << 40, 3); }), "rows"));
  for (const std::vector<hsize_t>& dims : {std::vector<hsize_t>{0, 2}, {0, 4}, {0}, {0, 64}})
    CHECK(mentions(edited(folder, [&](hid_t h5) { replace(h5, H5T_IEEE_F64LE, dims); }), "shape"));
  CHECK(mentions(edited(folder, [&](hid_t h5) { replace(h5, H5T_IEEE_F32LE, {300, 3}); }), "type"));
  CHECK(mentions(edited(folder,
                        [&](hid_t h5) {
                          replace(h5, H5T_IEEE_F64LE, {300, 3});
                        }),
                 "than are stored"));
}

TEST_CASE("impossible bodies that bend are refused before anything is recorded") {
  const Folder folder;
  const auto refused = [&](std::vector<RecordedBend> bends) {
    RecordingHead h = head();
    h.bends = std::move(bends);
    const auto made = Recorder::create(folder / "run.h5", h);
    return made ? std::string() : made.error();
  };
  CHECK(mentions(refused({{0, "a", 0}}), "0 modes"));
  CHECK(mentions(refused({{0, "a", 65}}), "65 modes"));
  CHECK(mentions(refused({{1, "a", 3}, {1, "b", 3}}), "order"));
  CHECK(mentions(refused({{1, "a", 3}, {0, "b", 3}}), "order"));
  CHECK(folder.files() == 0);
}
