// SPDX-License-Identifier: Apache-2.0
// Tests `hapsix study` from outside: rows, their order and bits, kills of the study and of its
// workers, and mistakes.
#include <algorithm>
#include <memory>
#include <random>
#include <string>

#include "tests/io/cli/program.h"

using namespace h6::test;

namespace {

constexpr const char* kStudy = R"({ "hapsix_study": 1, "scene": "peg-in-hole",
  "vary": { "contact.method": ["firm", "global"],
            "bodies.block.field.offset": { "from": 0, "to": 0.4, "count": 2 } },
  "draw": { "bodies.peg.pose.p.x": { "low": -0.2, "high": 0.2 } }, "repeats": 8, "seed": 3 })";

std::vector<std::string> lines(const std::string& text) {
  std::vector<std::string> out;
  std::stringstream in(text);
  for (std::string line; std::getline(in, line);) out.push_back(line);
  return out;
}

std::vector<std::string> fields(const std::string& row) {
  std::vector<std::string> out;
  std::stringstream in(row);
  for (std::string field; std::getline(in, field, ',');) out.push_back(field);
  return out;
}

// The processes that this one started.
std::vector<pid_t> children(pid_t of) {
  std::ifstream in("/proc/" + std::to_string(of) + "/task/" + std::to_string(of) + "/children");
  std::vector<pid_t> out;
  for (pid_t pid; in >> pid;) out.push_back(pid);
  return out;
}

std::string whole_table(Sandbox& box, const std::string& folder, const char* jobs) {
  const Json said = result_of(box, {"study", "study.json", "-o", folder, "--jobs", jobs});
  CHECK(said["failed"] == 0);
  CHECK_FALSE(fs::exists(box.file(folder + "/runs.csv.part")));
  return slurp(box.file(folder + "/runs.csv"));
}

// times.csv names each run once, in order, with a time that it can have taken.
void check_times(Sandbox& box, const std::string& folder, std::size_t runs) {
  const std::vector<std::string> times = lines(slurp(box.file(folder + "/times.csv")));
  REQUIRE(times.size() == 1 + runs);
  CHECK(times[0] == "run,seconds");
  for (std::size_t run = 0; run < runs; ++run) {
    CAPTURE(times[1 + run]);
    const std::vector<std::string> row = fields(times[1 + run]);
    REQUIRE(row.size() == 2);
    CHECK(row[0] == std::to_string(run));
    CHECK(std::stod(row[1]) > 0);
  }
}

}  // namespace

TEST_CASE("a study has a row for each run, in order, whatever the number of processes") {
  Sandbox box;
  spill(box.file("study.json"), kStudy);
  const std::string table = whole_table(box, "two", "2");
  CHECK(table == whole_table(box, "one", "1"));
  check_times(box, "two", 2 * 2 * 8);
  const std::vector<std::string> rows = lines(table);
  REQUIRE(rows.size() == 1 + 2 * 2 * 8);
  CHECK(
      rows[0].rfind(
          "run,repeat,contact.method,bodies.block.field.offset,bodies.peg.pose.p.x,verdict,frames",
          0) == 0);
  for (std::size_t run = 0; run + 1 < rows.size(); ++run) {
    const std::vector<std::string> row = fields(rows[run + 1]);
    CAPTURE(rows[run + 1]);
    CHECK(row[0] == std::to_string(run));
    CHECK(row[1] == std::to_string(run % 8));
    CHECK(row[2] == (run < 16 ? "firm" : "global"));
    CHECK(row[3] == (run / 8 % 2 ? "0.4" : "0.0"));
    // A repeat has the same draw in every combination.
    CHECK(row[4] == fields(rows[1 + run % 8])[4]);
    CHECK(std::fabs(std::stod(row[4])) <= 0.2);
    CHECK(row[6] == "1400");
  }
  // `firm` holds where `global` sinks in with no clearance left.
  CHECK(fields(rows[9])[5] == "held");
  CHECK(std::stod(fields(rows[25])[9]) > 3 * std::stod(fields(rows[9])[9]));
}

TEST_CASE(
    "a study that is killed again and again, or loses its workers, ends with the same table") {
  Sandbox box;
  spill(box.file("study.json"), kStudy);
  const std::string want = whole_table(box, "whole", "2");
  std::mt19937_64 random(5);
  int kills = 0;
  std::size_t most = 0;
  while (!fs::exists(box.file("killed/runs.csv")) && kills < 20) {
    auto process =
        std::make_unique<Process>(box, Args{"study", "study.json", "-o", "killed", "--jobs", "2"});
    std::this_thread::sleep_for(std::chrono::milliseconds(200 + random() % 800));
    const std::vector<pid_t> study = children(getpid());
    const auto workers = study.empty() ? study : children(study.front());
    if (kills % 2 && !workers.empty()) {  // a worker first: its run goes to another process
      kill(workers[random() % workers.size()], SIGKILL);
      std::this_thread::sleep_for(std::chrono::milliseconds(random() % 300));
    }
    process.reset();  // SIGKILL
    ++kills;
    const auto rows = lines(slurp(box.file("killed/runs.csv.part")));
    CHECK((rows.size() >= most || fs::exists(box.file("killed/runs.csv"))));  // nothing is lost
    most = rows.size();
  }
  CHECK(kills > 2);
  // A torn last row, as a loss of power leaves it.
  if (fs::exists(box.file("killed/runs.csv.part")))
    std::ofstream(box.file("killed/runs.csv.part"), std::ios::app) << "31,7,glob";
  std::ofstream(box.file("killed/times.csv"), std::ios::app) << "31,0.";
  CHECK(whole_table(box, "killed", "2") == want);
  check_times(box, "killed", 2 * 2 * 8);
  MESSAGE(kills << " kills");
}

TEST_CASE("a study says what is wrong before it runs, and keeps another's table") {
  Sandbox box;
  const auto refused = [&](const std::string& text, const char* words) {
    spill(box.file("bad.json"), text);
    const Ended end = run(box, {"study", "bad.json", "-o", "bad"});
    CHECK(end.code == 1);
    CHECK_MESSAGE(end.err.find(words) != std::string::npos, end.err);
    CHECK_FALSE(fs::exists(box.file("bad")));
  };
  const auto changed = [](const std::string& from, const std::string& to) {
    std::string text = kStudy;
    return text.replace(text.find(from), from.size(), to);
  };
  refused("{", "line 1");
  refused("[1]", "begins with");
  refused(changed("\"hapsix_study\": 1", "\"hapsix_study\": 2"), "begins with");
  refused(changed("peg-in-hole", "peg-in-hull"), "neither such a file nor such a generated scene");
  refused(changed("contact.method", "contact.methods"), "no such key");
  refused(changed("\"firm\"", "\"firmer\""), "firmer");
  refused(changed("bodies.block", "bodies.blok"), "the scene has no 'blok'");
  refused(changed("\"count\": 2", "\"count\": 0"), "must be a list");
  refused(changed("\"to\": 0.4", "\"two\": 0.4"), "unknown key 'two'");
  refused(changed("\"repeats\": 8", "\"repeats\": 900000"), "runs: 1 to");
  refused(changed("\"high\": 0.2", "\"high\": \"a\""), "needs a number 'high'");
  refused(
      changed("\"contact.method\": [\"firm\", \"global\"]", "\"hands.0.path\": [\"other.csv\"]"),
      "the path of a hand cannot vary");
  CHECK(run(box, {"study", "none.json", "-o", "bad"}).code == 1);
  CHECK(run(box, {"study", "bad.json"}).code == 2);

  std::string few = changed("\"repeats\": 8", "\"repeats\": 1");
  spill(box.file("study.json"), few);
  const std::string table = whole_table(box, "kept", "1");
  spill(box.file("study.json"), changed("\"repeats\": 8", "\"repeats\": 2"));
  const Ended other = run(box, {"study", "study.json", "-o", "kept"});
  CHECK(other.code == 1);
  CHECK(other.err.find("another study") != std::string::npos);
  CHECK(slurp(box.file("kept/runs.csv")) == table);
}

TEST_CASE("the table is Parquet too where Python has pyarrow") {
  Sandbox box;
  // A stand-in that writes what it was given: Debian 12 has no pyarrow.
  fs::create_directories(box.file("python/pyarrow"));
  spill(box.file("python/pyarrow/__init__.py"), "def string(): return 'text'\n");
  spill(box.file("python/pyarrow/csv.py"),
        "def ConvertOptions(column_types): return column_types\n"
        "def read_csv(name, convert_options): return open(name).read(), convert_options\n");
  spill(box.file("python/pyarrow/parquet.py"),
        "def write_table(table, name):\n"
        "    assert table[1]['state_hash'] == 'text'\n"
        "    open(name, 'w').write('PAR1' + table[0])\n");
  spill(box.file("study.json"), R"({"hapsix_study": 1, "scene": "box-on-wall", "repeats": 2})");
  ::setenv("PYTHONPATH", box.file("python").c_str(), 1);
  const Ended with = run(box, {"study", "study.json", "-o", "with"});
  spill(box.file("python/pyarrow/parquet.py"), "def write_table(table, name): raise OSError\n");
  const Ended fails = run(box, {"study", "study.json", "-o", "fails"});
  spill(box.file("python/pyarrow/__init__.py"), "raise ImportError\n");
  const Ended without = run(box, {"study", "study.json", "-o", "without"});
  ::unsetenv("PYTHONPATH");
  REQUIRE_MESSAGE(with.code == 0, with.err);
  CHECK(slurp(box.file("with/runs.parquet")) == "PAR1" + slurp(box.file("with/runs.csv")));
  CHECK(fails.code == 0);
  CHECK_MESSAGE(fails.err.find("pyarrow failed on fails/runs.csv") != std::string::npos, fails.err);
  CHECK(without.code == 0);
  CHECK(without.err.find("pyarrow") == std::string::npos);
  for (const char* name : {"fails/runs.parquet", "without/runs.parquet"})
    CHECK(!fs::exists(box.file(name)));
}

TEST_CASE("a run that fails has a row that says why, and the others have theirs") {
  Sandbox box;
  // The peg starts 20 mm to the side: more than 3 voxels deep in the block, which a run refuses.
  spill(box.file("study.json"), R"({ "hapsix_study": 1, "scene": "peg-in-hole",
    "vary": { "bodies.peg.pose.p.x": [0, 20] } })");
  const Ended end = run(box, {"study", "study.json", "-o", "out", "--json"});
  CHECK(end.code == 1);
  CHECK(Json::parse(end.out)["failed"] == 1);
  const std::vector<std::string> rows = lines(slurp(box.file("out/runs.csv")));
  REQUIRE(rows.size() == 3);
  CHECK(fields(rows[1])[4] == "1400");
  CHECK(fields(rows[2])[3] == "error");
  CHECK(rows[2].find("deep") != std::string::npos);
}

TEST_CASE("a study of several scenes gives each the same runs, with the bits that it has alone") {
  Sandbox box;
  const auto study = [&](const std::string& scene, const char* drawn = "contact.stiffness") {
    const Json range = {{"low", 5000}, {"high", 20000}};
    spill(box.file("study.json"), Json{{"hapsix_study", 1},
                                       {"scene", Json::parse(scene)},
                                       {"vary", {{"contact.method", {"firm", "global"}}}},
                                       {"draw", {{drawn, range}}},
                                       {"repeats", 2}}
                                      .dump());
  };
  study(R"(["peg-in-hole", "box-on-wall"])");
  const std::string table = whole_table(box, "both", "2");
  CHECK(table == whole_table(box, "one", "1"));
  const std::vector<std::string> rows = lines(table);
  REQUIRE(rows.size() == 1 + 2 * 2 * 2);
  CHECK(rows[0].rfind("run,repeat,scene,contact.method,contact.stiffness,verdict,", 0) == 0);
  for (std::size_t run = 0; run < 8; ++run) {
    const std::vector<std::string> row = fields(rows[1 + run]);
    CHECK(row[2] == (run < 4 ? "peg-in-hole" : "box-on-wall"));
    CHECK(row[3] == (run / 2 % 2 ? "global" : "firm"));
    CHECK(row[4] == fields(rows[1 + run % 2])[4]);
  }
  study(R"("box-on-wall")");
  const std::vector<std::string> alone = lines(whole_table(box, "alone", "2"));
  REQUIRE(alone.size() == 1 + 2 * 2);
  // A row from the method on; no field before it is the method's name.
  const auto rest = [](const std::string& row, std::size_t method) {
    return row.substr(row.find("," + fields(row)[method] + ","));
  };
  for (std::size_t run = 0; run < 4; ++run)
    CHECK(rest(rows[5 + run], 3) == rest(alone[1 + run], 2));

  const auto refused = [&](const std::string& scene, const char* words,
                           const char* drawn = "contact.stiffness") {
    study(scene, drawn);
    const Ended end = run(box, {"study", "study.json", "-o", "bad"});
    CHECK(end.code == 1);
    CHECK_MESSAGE(end.err.find(words) != std::string::npos, end.err);
    CHECK_FALSE(fs::exists(box.file("bad")));
  };
  refused("[]", "a list of scenes has 1 to 100");
  refused("7", "names a \"scene\"");
  refused(R"(["peg-in-hole", 7])", "a scene of the list is no name");
  refused(R"(["peg-in-hole", "peg-in-hull"])", "neither such a file nor such a generated scene");
  refused(R"(["peg-in-hole", "peg-in-hole"])", "two scenes of the list have the name");
  refused(R"(["box-on-wall", "peg-in-hole"])", "the scene has no 'box'", "bodies.box.mass");
}

TEST_CASE("a study runs its own scenes, whatever a study that failed left in the folder") {
  Sandbox box;
  const auto study = [&](const std::string& scenes, const char* vary) {
    spill(box.file("study.json"), R"({"hapsix_study": 1, "scene": )" + scenes + R"(, "vary": {)" +
                                      vary + R"(}, "repeats": 2})");
  };
  constexpr const char* kGood = R"("contact.method": ["firm", "global"])";
  const std::pair<const char*, const char*> of[] = {
      {R"("peg-in-hole")", R"("box-on-wall")"},
      {R"(["peg-in-hole", "cone-in-gap"])", R"(["box-on-wall", "peg-in-hole"])"}};
  for (const auto& [failed, next] : of) {
    fs::remove_all(box.file("used")), fs::remove_all(box.file("fresh"));
    fs::create_directories(box.file("used"));
    study(failed, R"("contact.method": ["firmer"])");
    CHECK(run(box, {"study", "study.json", "-o", "used"}).code == 1);
    study(next, kGood);
    const std::string table = whole_table(box, "used", "1");
    CHECK((table == whole_table(box, "fresh", "1")));
  }
}

TEST_CASE("a scene or a value that is called error is no failed run") {
  Sandbox box;
  REQUIRE(run(box, {"scene", "export", "box-on-wall", "."}).code == 0);
  Json scene = Json::parse(slurp(box.file("scene.json")));
  scene["name"] = "error";
  spill(box.file("scene.json"), scene.dump());
  spill(
      box.file("study.json"),
      R"({"hapsix_study": 1, "scene": ["scene.json", "peg-in-hole"], "vary": {"name": ["error"]}})");
  const std::vector<std::string> rows = lines(whole_table(box, "out", "1"));  // none has failed
  REQUIRE(rows.size() == 3);
  CHECK(fields(rows[1])[2] == "error");
}

TEST_CASE("the studies of the examples run, each of their rows") {
  // The examples lie at the same place in every tree; one repeat of each combination is enough.
  const fs::path root = fs::path(__FILE__).parent_path() / "../../..";
  const std::pair<const char*, std::size_t> examples[] = {{"clearance", 20}, {"robustness", 90}};
  for (const auto& [name, count] : examples) {
    CAPTURE(name);
    Sandbox box;
    Json study = Json::parse(slurp(root / "io/examples" / (std::string(name) + ".json")));
    study["repeats"] = 1;
    std::size_t runs = study["scene"].is_array() ? study["scene"].size() : 1;
    for (const auto& [key, values] : study["vary"].items())
      runs *= values.is_array() ? values.size() : values["count"].get<std::size_t>();
    spill(box.file("study.json"), study.dump());
    const std::vector<std::string> rows = lines(whole_table(box, "out", "2"));  // none has failed
    REQUIRE(rows.size() == 1 + runs);
    CHECK(runs == count);
    const std::vector<std::string> names = fields(rows[0]);
    const auto frames = std::find(names.begin(), names.end(), "frames");
    REQUIRE(frames != names.end());
    for (std::size_t run = 0; run < runs; ++run) {
      CAPTURE(rows[1 + run]);
      CHECK(fields(rows[1 + run]).at(0) == std::to_string(run));
      CHECK(std::stoul(
                fields(rows[1 + run]).at(static_cast<std::size_t>(frames - names.begin()))) >= 500);
    }
  }
}
