// SPDX-License-Identifier: Apache-2.0
// bind_recordings.cpp - frames as structured arrays, recordings, and weights for other simulators.
#include <mutex>

#include "python/bindings.h"
#include "python/rows.h"

namespace hapsix::python {

void declare_rows() {
  PYBIND11_NUMPY_DTYPE(h6Vec3, x, y, z);
  PYBIND11_NUMPY_DTYPE(h6Quat, w, x, y, z);
  PYBIND11_NUMPY_DTYPE(h6Pose, p, q);
  PYBIND11_NUMPY_DTYPE(h6Velocity, linear, angular);
  PYBIND11_NUMPY_DTYPE(h6Wrench, force, torque);
  PYBIND11_NUMPY_DTYPE(h6DeviceSample, pose, velocity, buttons, wrench, sequence);
  PYBIND11_NUMPY_DTYPE(h6DeviceCommand, wrench, pose, velocity, cause, causes);
  PYBIND11_NUMPY_DTYPE(h6BodyState, pose, velocity);
  PYBIND11_NUMPY_DTYPE(h6SafetyInput, asked, overdue);
  PYBIND11_NUMPY_DTYPE(h6Overlap, shell_body, field_body, points, relieved, depth, depth_voxels,
                       deepest);
  PYBIND11_NUMPY_DTYPE(h6FrameReport, frame, status, contacts, max_depth, max_depth_voxels,
                       stage_us, frame_us, state_hash, series_iterations, series_residual,
                       net_stiffness_min, net_stiffness_max, passivity_energy, coarse_pairs,
                       coarse_points, missed_depth_voxels, fit_depth_voxels, substeps);
  PYBIND11_NUMPY_DTYPE(h6FrameRecord, time, report, hand, command, body, wakeup_us, late, state,
                       late_us, cpu_us, safety_input, settings, inputs_only);
}

namespace {

// A recording or recorder belongs to one thread at a time, so Python's threads take turns. A turn
// begins after the interpreter's lock was let go, else its owner could wait for that lock for ever.
using Turn = std::lock_guard<std::mutex>;

struct PyRecording {
  Unlocked<Recording> recording;
  std::mutex mutex;
  h6RecordingInfo info{};
};

std::shared_ptr<PyRecording> read_recording(const std::string& file) {
  auto made = std::make_shared<PyRecording>();
  py::gil_scoped_release release;
  made->recording =
      Recording::make([&](h6Error* error) { return h6ReadRecording(file.c_str(), error); });
  h6GetRecording(made->recording, &made->info);
  return made;
}

py::array_t<h6FrameRecord> frames_of(PyRecording& r, std::uint64_t first,
                                     std::optional<std::uint64_t> count) {
  const std::uint64_t left = r.info.frames - std::min(first, r.info.frames);
  const std::uint64_t rows = std::min(left, count.value_or(left));
  py::array_t<h6FrameRecord> out(rows);
  h6FrameRecord* to = out.mutable_data();
  h6Error error{};
  std::int64_t got;
  {
    py::gil_scoped_release release;
    const Turn turn(r.mutex);
    got = h6GetRecordingFrames(r.recording, first, to, rows, &error);
  }
  if (got < 0) throw Error(error);
  if (static_cast<std::uint64_t>(got) == rows) return out;
  return out[py::slice(0, got, 1)].cast<py::array_t<h6FrameRecord>>();
}

std::size_t modes_of(const PyRecording& r) {
  std::size_t modes = 0;
  h6RecordingBend bend;
  for (std::size_t i = 0; h6GetRecordingBend(r.recording, i, &bend); ++i) modes += bend.modes;
  return modes;
}

Typed<py::dict, "Dict[int, numpy.ndarray[numpy.float64]]"> bends_of(
    PyRecording& r, std::uint64_t first, std::optional<std::uint64_t> count) {
  const std::uint64_t left = r.info.frames - std::min(first, r.info.frames);
  const std::uint64_t rows = std::min(left, count.value_or(left));
  const std::size_t modes = modes_of(r);
  py::dict out;
  if (modes == 0) return out;
  py::array_t<double> all({static_cast<std::size_t>(rows), modes});
  double* to = all.mutable_data();
  h6Error error{};
  std::int64_t got;
  {
    py::gil_scoped_release release;
    const Turn turn(r.mutex);
    got = h6GetRecordingBends(r.recording, first, to, rows, &error);
  }
  if (got < 0) throw Error(error);
  h6RecordingBend bend;
  std::size_t from = 0;
  for (std::size_t i = 0; h6GetRecordingBend(r.recording, i, &bend); from += bend.modes, ++i) {
    const auto start = static_cast<py::ssize_t>(from),
               end = static_cast<py::ssize_t>(from + bend.modes);
    out[py::int_(bend.body)] = all[py::make_tuple(py::slice(0, got, 1), py::slice(start, end, 1))];
  }
  return out;
}

Typed<py::list, "List[Tuple[float, str, str]]"> events_of(const PyRecording& r) {
  py::list out;
  for (std::size_t i = 0; i < r.info.events; ++i)
    if (h6RecordingEvent event; h6GetRecordingEvent(r.recording, i, &event))
      out.append(py::make_tuple(event.time, event.what, event.detail));
  return out;
}

void add_reader(py::module_& m) {
  py::class_<PyRecording, std::shared_ptr<PyRecording>>(
      m, "Recording", "A recorded run, or what a killed run left of one.")
      .def(
          py::init(&read_recording), py::arg("file"),
          "An .h5 file. Frames are read when they are asked for; an Error says why a file is none.")
      .def(
          "__len__", [](const PyRecording& r) { return r.info.frames; },
          "How many frames there are.")
      .def("frames", &frames_of, py::arg("first") = 0, py::arg("count") = py::none(),
           "Rows first .. first + count as a structured array: ['time'] [s], "
           "['report']['contacts'], "
           "['hand'] (n, 8), ['command'], ['body'], ...; the member names of h6FrameRecord")
      .def("bends", &bends_of, py::arg("first") = 0, py::arg("count") = py::none(),
           "The same frames of the bodies that bend: {index of the body: (n, r) coordinates q "
           "[m sqrt(kg)]}, NaN where they are not known; {} where nothing bends, and of older "
           "recordings.")
      .def_property_readonly(
          "rate", [](const PyRecording& r) { return r.info.rate; }, "[Hz]")
      .def_property_readonly(
          "hands", [](const PyRecording& r) { return r.info.hands; }, "how many each frame has")
      .def_property_readonly(
          "whole", [](const PyRecording& r) { return r.info.whole; }, "False: the run was killed")
      .def_property_readonly(
          "scene", [](const PyRecording& r) { return r.info.scene; }, "JSON, or ''")
      .def_property_readonly(
          "summary", [](const PyRecording& r) { return r.info.summary; }, "JSON, or ''")
      .def_property_readonly(
          "program", [](const PyRecording& r) { return r.info.program; },
          "name and version of what recorded it")
      .def_property_readonly("events", &events_of, "list of (time [s], what, detail)");
}

struct PyRecorder {
  std::shared_ptr<PyScene> scene;
  Unlocked<Recorder> recorder;
  std::mutex mutex;
  // Without the interpreter's lock.
  void add(const h6FrameRecord* rows, std::size_t count, const std::vector<double>& q = {}) {
    h6Error error{};
    const Turn turn(mutex);
    if (!h6RecordFramesWithBends(recorder, rows, count, q.empty() ? nullptr : q.data(), q.size(),
                                 &error))
      throw Error(error);
  }
};

// q of all bodies that bend, one after another.
std::vector<double> q_of(const PySession& s) {
  std::vector<double> all;
  double q[H6_MAX_MODES];
  for (std::size_t b = 0; b < s.bodies; ++b) {
    const std::size_t modes =
        h6GetDeformation(s.session, static_cast<std::int32_t>(b), q, nullptr, H6_MAX_MODES);
    all.insert(all.end(), q, q + modes);
  }
  return all;
}

std::shared_ptr<PyRecorder> make_recorder(const std::string& file, std::shared_ptr<PyScene> scene,
                                          const Definition* definition,
                                          const std::string& program) {
  auto made = std::make_shared<PyRecorder>();
  made->scene = std::move(scene);
  h6RecorderDef def = h6DefaultRecorderDef();
  def.scene = made->scene ? made->scene->scene.get() : nullptr;
  def.program = program.c_str();
  def.virtual_time = true;
  std::optional<Definition> copy;
  if (definition) copy.emplace(*definition);
  py::gil_scoped_release release;
  const auto create = [&](const h6SessionDef* session) {
    def.session = session;
    return Recorder::make(
        [&](h6Error* error) { return h6CreateRecorder(file.c_str(), &def, error); });
  };
  made->recorder =
      copy ? copy->with([&](const h6SessionDef& s) { return create(&s); }) : create(nullptr);
  return made;
}

void add_recorder(py::module_& m) {
  py::class_<PyRecorder, std::shared_ptr<PyRecorder>>(
      m, "Recorder",
      "Writes a recording (.h5); a killed program loses at most half a second of it.")
      .def(py::init(&make_recorder), py::arg("file"), py::arg("scene") = nullptr,
           py::arg("definition") = nullptr, py::arg("program") = "python",
           "Of a run of `scene`, which is kept in the recording, or of a session with this "
           "`definition`.")
      .def(
          "record",
          [](PyRecorder& r, const PySession& s) {
            h6FrameRecord row;
            std::vector<double> q;
            py::gil_scoped_release release;
            {
              const Turn turn(s.mutex);
              h6GetRecord(s.session, s.samples.data(), s.commands.data(), &row);
              if (r.scene) q = q_of(s);
            }
            r.add(&row, 1, q);
          },
          py::arg("session"),
          "Adds the session's last frame, a whole one also where another thread steps it.")
      .def(
          "record",
          [](PyRecorder& r, const py::array_t<h6FrameRecord, py::array::c_style>& rows) {
            const h6FrameRecord* data = rows.data();
            const auto count = static_cast<std::size_t>(rows.size());
            py::gil_scoped_release release;
            r.add(data, count);
          },
          py::arg("frames"),
          "Adds the rows that Session.follow returned; shapes of bodies that bend are not in them "
          "and stand as NaN.")
      .def(
          "finish",
          [](PyRecorder& r, const std::optional<std::string>& summary) {
            h6Error error{};
            py::gil_scoped_release release;
            const Turn turn(r.mutex);
            if (!h6FinishRecorder(r.recorder, summary ? summary->c_str() : nullptr, &error))
              throw Error(error);
          },
          py::arg("summary") = py::none(), "Makes the file. summary: one JSON object, or None.");
}

using Weighed = Typed<py::tuple,
                      "Tuple[numpy.ndarray[numpy.float32], numpy.ndarray[numpy.float64], "
                      "numpy.ndarray[numpy.float64], numpy.ndarray[numpy.float64]]">;
Weighed weigh(const Rows<float>& normals, const Rows<float>& arms, const Rows<float>& depths,
              double voxel, double lever, const std::optional<Rows<float>>& gradients,
              const std::optional<Numbers<h6Velocity>>& velocity, const h6ContactDef* contact,
              bool exact) {
  h6ContactArrays a = h6DefaultContactArrays();
  a.count = rows_of(normals, 3, "normals");
  const auto same = [&](bool fits, const char* name, const char* shape) {
    if (!fits)
      throw py::value_error(std::string(name) + " must have the shape " + shape +
                            " with the rows of normals");
  };
  same(rows_of(arms, 3, "arms") == a.count, "arms", "(n, 3)");
  same(static_cast<std::size_t>(depths.size()) == a.count, "depths", "(n,)");
  if (gradients) same(rows_of(*gradients, 3, "gradients") == a.count, "gradients", "(n, 3)");
  a.normals = normals.data(), a.arms = arms.data(), a.depths = depths.data();
  a.gradients = gradients ? gradients->data() : nullptr;
  const h6Velocity u = velocity ? struct_of<h6Velocity>(*velocity) : h6Velocity{};
  a.velocity = velocity ? &u : nullptr;
  a.form = exact ? H6_EXACT : H6_SYMMETRIC;
  const h6ContactDef rule = contact ? *contact : h6DefaultContactDef();
  py::array_t<float> weights(a.count);
  py::array_t<double> wrench(6), stiffness({6, 6}), damping({6, 6});
  float* w = weights.mutable_data();
  auto* f = reinterpret_cast<h6Wrench*>(wrench.mutable_data());
  double *k = stiffness.mutable_data(), *d = damping.mutable_data();
  {
    py::gil_scoped_release release;
    h6Error error{};
    if (h6WeighContacts(&rule, &a, voxel, lever, w, f, k, d, &error) != 0) throw Error(error);
  }
  return py::make_tuple(weights, wrench, stiffness, damping);
}

}  // namespace

void add_recordings(py::module_& m) {
  add_reader(m);
  add_recorder(m);
  m.def("weigh", &weigh, py::arg("normals"), py::arg("arms"), py::arg("depths"), py::kw_only(),
        py::arg("voxel"), py::arg("lever"), py::arg("gradients") = py::none(),
        py::arg("velocity") = py::none(), py::arg("contact") = nullptr, py::arg("exact") = false,
        "Weights of any simulator's contacts: normals (n, 3) unit, the direction of the push; arms "
        "(n, 3) "
        "from the centre of mass [m]; depths (n,) > 0 inside [m]; voxel: the length of l0 and "
        "clusters "
        "[m]; lever: at least the largest arm, the same in every call [m]; velocity (6,) of the "
        "body. "
        "Returns weights (n,), wrench (6,) [N, N m], stiffness (6, 6) and damping (6, 6), its "
        "derivatives by q = (x, theta) and by velocity.");
}

}  // namespace hapsix::python
