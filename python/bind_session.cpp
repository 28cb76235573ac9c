// SPDX-License-Identifier: Apache-2.0
// bind_session.cpp - a session: samples and commands as arrays that it owns, contacts as views.
#include "python/bindings.h"
#include "python/rows.h"

namespace hapsix::python {
namespace {

using SessionPtr = std::shared_ptr<PySession>;

// Rows of a column, three next to each other: (count, 3). The engine's columns of x, y and z have
// equal distances, so this is a view; else it is a copy.
py::array_t<float> three(const float* x, const float* y, const float* z, std::size_t count,
                         py::handle owner) {
  const auto gap = reinterpret_cast<const char*>(y) - reinterpret_cast<const char*>(x);
  const auto n = static_cast<py::ssize_t>(count);
  if (reinterpret_cast<const char*>(z) - reinterpret_cast<const char*>(y) == gap)
    return view(x, {n, 3}, {sizeof(float), gap}, owner);
  py::array_t<float> rows({n, py::ssize_t{3}});
  auto to = rows.mutable_unchecked<2>();
  for (py::ssize_t i = 0; i < n; ++i) to(i, 0) = x[i], to(i, 1) = y[i], to(i, 2) = z[i];
  return rows;
}

struct PyContacts {
  SessionPtr session;
  h6Contacts c;
  std::int32_t body;
};

void add_contacts(py::module_& m) {
  using P = PyContacts;
  const auto in = [](auto get) {
    return [get](const P& p) { return column(get(p.c), p.c.count, py::cast(p.session)); };
  };
  py::class_<P>(
      m, "Contacts",
      "Contacts of a shell body in the last frame: views, valid until the next step (later "
      "they show whatever is there then). World frame. Rows with depth <= 0 are about to touch.")
      .def(
          "__len__", [](const P& p) { return p.c.count; }, "How many rows there are.")
      .def_property_readonly("depth", in([](const h6Contacts& c) { return c.depth; }),
                             "(n,) float32 [m]")
      .def_property_readonly("weight", in([](const h6Contacts& c) { return c.weight; }),
                             "(n,) float32, share of the stiffness")
      .def_property_readonly("load", in([](const h6Contacts& c) { return c.load; }),
                             "(n,) float32, force along the normal over k [m]")
      .def_property_readonly("point", in([](const h6Contacts& c) { return c.point; }),
                             "(n,) uint32, index into the shell's points")
      .def_property_readonly("field_body", in([](const h6Contacts& c) { return c.field_body; }),
                             "(n,) int32, the body whose field it touches")
      .def_property_readonly(
          "normal",
          [](const P& p) { return three(p.c.nx, p.c.ny, p.c.nz, p.c.count, py::cast(p.session)); },
          "(n, 3) float32, inward unit normal; `firm`: direction of the push")
      .def_property_readonly(
          "gradient",
          [](const P& p) { return three(p.c.gx, p.c.gy, p.c.gz, p.c.count, py::cast(p.session)); },
          "(n, 3) float32, unit gradient of the field, outward")
      .def_property_readonly(
          "arm",
          [](const P& p) { return three(p.c.rx, p.c.ry, p.c.rz, p.c.count, py::cast(p.session)); },
          "(n, 3) float32, from the centre of mass [m]")
      .def_property_readonly(
          "torque_direction",
          [](const P& p) { return three(p.c.tx, p.c.ty, p.c.tz, p.c.count, py::cast(p.session)); },
          "(n, 3) float32")
      .def(
          "names",
          [](const P& p) -> Typed<py::tuple,
                                  "Tuple[numpy.ndarray[numpy.int32], "
                                  "numpy.ndarray[numpy.int32]]"> {
            py::array_t<std::int32_t> part(p.c.count), triangle(p.c.count);
            std::int32_t *parts = part.mutable_data(), *triangles = triangle.mutable_data();
            {
              py::gil_scoped_release release;
              const std::lock_guard turn(p.session->mutex);
              h6NameContacts(p.session->session, p.body, parts, triangles);
            }
            return py::make_tuple(part, triangle);
          },
          "part (n,), triangle (n,) int32 of the field's mesh that each touches; -1: not known. "
          "Call it "
          "before the next step.");
}

// A member of each row of samples or commands: (hands, ...), strided over the structs.
template <class Row, class T>
auto rows(T Row::*member, std::array<Row, H6_MAX_HANDS> PySession::*of, bool writable) {
  return [=](const SessionPtr& s) {
    Row* first = ((*s).*of).data();
    const auto hands = static_cast<py::ssize_t>(s->hands);
    if constexpr (sizeof(T) > 8)
      return view(reinterpret_cast<const double*>(&(first->*member)),
                  {hands, static_cast<py::ssize_t>(kNumbers<T>)}, {sizeof(Row), 8}, py::cast(s),
                  writable);
    else
      return view(&(first->*member), {hands}, {sizeof(Row)}, py::cast(s), writable);
  };
}

// Numbers of a sample that a call gives: (hands, n), or (n,) for one hand.
template <class T>
struct Given {
  T h6DeviceSample::*member;
  const double* values = nullptr;  // null: the sample stays
  Given(const PySession& s, T h6DeviceSample::*of, const Rows<double>* from, const char* name)
      : member(of) {
    if (!from) return;
    const auto n = static_cast<py::ssize_t>(kNumbers<T>);
    if (from->size() != n * static_cast<py::ssize_t>(s.hands) || from->shape(from->ndim() - 1) != n)
      throw py::value_error(std::string(name) + " must have the shape (" + std::to_string(s.hands) +
                            ", " + std::to_string(n) + ")");
    values = from->data();
  }
  void put(PySession& s) const {
    for (std::size_t h = 0; values && h < s.hands; ++h)
      std::memcpy(&(s.samples[h].*member), values + h * kNumbers<T>, sizeof(T));
  }
};

// One turn: the samples that it puts in place are those of its frame.
template <class Put>
h6Status step_after(PySession& s, const Put& put) {
  py::gil_scoped_release release;
  const std::lock_guard turn(s.mutex);
  put();
  const h6Status status = h6Step(s.session, s.samples.data(), s.commands.data());
  s.show();
  return status;
}

h6Status step(PySession& s) {
  return step_after(s, [] {});
}

h6Status step_with(PySession& s, const Rows<double>& pose,
                   const std::optional<Rows<double>>& velocity,
                   const std::optional<Rows<double>>& wrench,
                   std::optional<std::uint32_t> buttons) {
  const Given at(s, &h6DeviceSample::pose, &pose, "pose");
  const Given by(s, &h6DeviceSample::velocity, velocity ? &*velocity : nullptr, "velocity");
  const Given with(s, &h6DeviceSample::wrench, wrench ? &*wrench : nullptr, "wrench");
  return step_after(s, [&] {
    at.put(s), by.put(s), with.put(s);
    for (std::size_t h = 0; h < s.hands && buttons; ++h) s.samples[h].buttons = *buttons;
  });
}

// Most calls give a pose alone, as an array of doubles: three arguments less save 0.6 µs of the 2.1
// beyond C, and an array that is not looked at for conversion 0.3 µs.
h6Status step_at(PySession& s, const py::array& pose) {
  const Rows<double> doubles =
      Rows<double>::check_(pose) ? py::reinterpret_borrow<Rows<double>>(pose) : Rows<double>(pose);
  const Given at(s, &h6DeviceSample::pose, &doubles, "pose");
  return step_after(s, [&] { at.put(s); });
}

// One frame for each row of poses (n, hands, 7), without the interpreter: the frames as rows.
py::array_t<h6FrameRecord> follow(PySession& s, const Rows<double>& poses) {
  const auto hands = static_cast<py::ssize_t>(s.hands);
  if (poses.ndim() != 3 || poses.shape(1) != hands || poses.shape(2) != 7)
    throw py::value_error("poses must have the shape (frames, " + std::to_string(hands) + ", 7)");
  const auto frames = static_cast<std::size_t>(poses.shape(0));
  py::array_t<h6FrameRecord> out(frames);
  h6FrameRecord* to = out.mutable_data();
  const double* from = poses.data();
  py::gil_scoped_release release;
  const std::lock_guard turn(s.mutex);
  for (std::size_t i = 0; i < frames; ++i) {
    for (std::size_t h = 0; h < s.hands; ++h)
      std::memcpy(&s.samples[h].pose, from + 7 * (i * s.hands + h), sizeof(h6Pose));
    h6Step(s.session, s.samples.data(), s.commands.data());
    h6GetRecord(s.session, s.samples.data(), s.commands.data(), &to[i]);
  }
  s.show();
  return out;
}

std::int32_t body_at(const PySession& s, std::int32_t body) {
  if (body < 0 || static_cast<std::size_t>(body) >= s.bodies)
    throw py::index_error("body " + std::to_string(body) + " does not exist: the session has " +
                          std::to_string(s.bodies));
  return body;
}
std::int32_t hand_at(const PySession& s, std::int32_t hand) {
  if (hand < 0 || static_cast<std::size_t>(hand) >= s.hands)
    throw py::index_error("hand " + std::to_string(hand) + " does not exist: the session has " +
                          std::to_string(s.hands));
  return hand;
}

py::array_t<double> body_of(const PySession& s, std::int32_t body) {
  const SessionTurn turn(s);
  const h6BodyState state = h6GetBody(s.session, body_at(s, body));
  py::array_t<double> out(13);
  std::memcpy(out.mutable_data(), &state, sizeof state);
  return out;
}

py::array_t<double> deformation_of(const PySession& s, std::int32_t body) {
  const SessionTurn turn(s);
  double q[H6_MAX_MODES];
  const std::size_t modes = h6GetDeformation(s.session, body_at(s, body), q, nullptr, H6_MAX_MODES);
  return py::array_t<double>(static_cast<py::ssize_t>(modes), q);
}

Typed<py::dict, "_Safety"> safety_of(const PySession& s, std::int32_t hand) {
  const SessionTurn turn(s);
  h6HandSafety safety;
  h6GetSafety(s.session, hand_at(s, hand), &safety);
  py::dict frames;
  for (int i = 1; i < H6_CAUSE_COUNT; ++i)
    if (safety.frames[i]) frames[h6CauseName(static_cast<h6Cause>(i))] = safety.frames[i];
  using namespace py::literals;
  return {py::dict("state"_a = h6DeviceStateName(safety.state),
                   "fault"_a = h6CauseName(safety.fault), "frames"_a = frames)};
}

py::array_t<h6FrameReport> frame_of(const PySession& s) {
  const SessionTurn turn(s);
  py::array_t<h6FrameReport> row(1);
  *row.mutable_data() = h6GetFrame(s.session);
  return row.attr("reshape")(py::tuple(0));
}

py::array_t<h6FrameReport> report_of(const SessionPtr& s) {
  const SessionTurn turn(*s);
  s->shows_report = true;
  s->show();
  return view(&s->report, {}, {}, py::cast(s));
}

py::array_t<double> states_of(const SessionPtr& s) {
  const SessionTurn turn(*s);
  s->shows_states = true;
  s->show();
  return view(reinterpret_cast<const double*>(s->states.data()),
              {static_cast<py::ssize_t>(s->bodies), 13}, {sizeof(h6BodyState), sizeof(double)},
              py::cast(s));
}

py::array_t<h6Overlap> overlaps_of(const PySession& s) {
  const SessionTurn turn(s);
  const auto made = overlaps(s.session);
  py::array_t<h6Overlap> out(made.size());
  std::copy(made.begin(), made.end(), out.mutable_data());
  return out;
}

void add_steps(py::class_<PySession, SessionPtr>& c) {
  using S = PySession;
  c.def("step", &step,
        "One frame with what stands in `pose`, `velocity`, `wrench` and `buttons`; returns "
        "the status bits (status_names), 0: nothing was dropped or limited.")
      .def("step", &step_at, py::arg("pose"),
           "Puts this sample of each hand, (hands, 7), in place first.")
      .def("step", &step_with, py::arg("pose"), py::arg("velocity") = py::none(),
           py::arg("wrench") = py::none(), py::arg("buttons") = py::none(),
           "Puts these samples, (hands, 7) and (hands, 6), in place first.")
      .def("follow", &follow, py::arg("poses"),
           "A frame for each row of poses (n, hands, 7), without the interpreter; the frames as a "
           "structured array (n,), the rows of a recording.")
      .def_property_readonly("pose", rows(&h6DeviceSample::pose, &S::samples, true),
                             "(hands, 7) sample of each hand, to be written [m]")
      .def_property_readonly("velocity", rows(&h6DeviceSample::velocity, &S::samples, true),
                             "(hands, 6) of the samples [m/s, rad/s]")
      .def_property_readonly("wrench", rows(&h6DeviceSample::wrench, &S::samples, true),
                             "(hands, 6) of the samples, in the admittance modes [N, N m]")
      .def_property_readonly("buttons", rows(&h6DeviceSample::buttons, &S::samples, true),
                             "(hands,)")
      .def_property_readonly("command", rows(&h6DeviceCommand::wrench, &S::commands, false),
                             "(hands, 6) wrench on each hand after the last step [N, N m]")
      .def_property_readonly("command_pose", rows(&h6DeviceCommand::pose, &S::commands, false),
                             "(hands, 7)")
      .def_property_readonly("causes", rows(&h6DeviceCommand::causes, &S::commands, false),
                             "(hands,) bits: cause_names");
}

void add_state(py::class_<PySession, SessionPtr>& c) {
  using S = PySession;
  c.def("body", &body_of, py::arg("body"),
        "(13,) pose (7) and velocity (6) of a body; a copy, to be kept. `states` is a view.")
      .def("deformation", &deformation_of, py::arg("body"),
           "(r,) coordinates q of a body whose shell bends [m sqrt(kg)], (0,) of others; a copy, "
           "since it is small")
      .def_property_readonly(
          "states", &states_of,
          "(bodies, 13) pose (7) and velocity (6) of each body after the last step: a view, which "
          "shows the next step, too. Once it was taken, each step takes the time to fill it.")
      .def_property_readonly(
          "report", &report_of,
          "The last frame's report, a structured scalar with the members of `frame`: a view, which "
          "shows the next step, too. Take it once, before the loop.")
      .def(
          "set_body",
          [](S& s, std::int32_t body, const Numbers<h6Pose>& pose,
             const Numbers<h6Velocity>& velocity) {
            const h6BodyState state{struct_of<h6Pose>(pose), struct_of<h6Velocity>(velocity)};
            const SessionTurn turn(s);
            h6SetBody(s.session, body_at(s, body), &state);
            s.show();
          },
          py::arg("body"), py::arg("pose"), py::arg("velocity") = Numbers<h6Velocity>{},
          "Teleports a body; an overlap that it makes pushes in full.")
      .def(
          "contacts",
          [](const SessionPtr& s, std::int32_t body) {
            const SessionTurn turn(*s);
            return PyContacts{s, h6GetContacts(s->session, body_at(*s, body)), body};
          },
          py::arg("body"), "Contacts of a shell body in the last frame, as views.")
      .def_property_readonly("frame", &frame_of,
                             "The last frame's report, a structured scalar: frame['contacts'], "
                             "['max_depth'] [m], ['frame_us'], ['state_hash'], ...; a copy, to be "
                             "kept. `report` is a view.")
      .def_property_readonly("overlaps", &overlaps_of,
                             "Overlaps at the start, a structured array; a copy, since there are "
                             "few and a step changes none")
      .def(
          "restart_fit",
          [](S& s) {
            py::gil_scoped_release release;
            const std::lock_guard turn(s.mutex);
            h6Error error{};
            if (!h6RestartFit(s.session, &error)) throw Error(error);
            s.show();
          },
          "Makes the present poses a new start.")
      .def(
          "voxel",
          [](const S& s, std::int32_t body) { return h6GetVoxel(s.session, body_at(s, body)); },
          py::arg("body"), "[m]")
      .def(
          "coupling",
          [](const S& s, std::int32_t hand) { return h6GetCoupling(s.session, hand_at(s, hand)); },
          py::arg("hand"), "The Coupling in use, with derived values.")
      .def("safety", &safety_of, py::arg("hand"), "dict: state, fault, frames with each cause")
      .def(
          "arm",
          [](S& s) {
            const SessionTurn turn(s);
            h6Arm(s.session);
          },
          "Clears faults and starts again softly.")
      .def(
          "disarm", [](S& s) { h6Disarm(s.session); }, "Lets every output decay to zero.")
      .def(
          "note_interval",
          [](S& s, double seconds) {
            const SessionTurn turn(s);
            h6NoteInterval(s.session, seconds);
          },
          py::arg("seconds"), "From the last commands to the next [s], for a loop in real time.")
      .def_property_readonly(
          "hands", [](const S& s) { return s.hands; }, "how many there are")
      .def_property_readonly(
          "bodies", [](const S& s) { return s.bodies; }, "how many there are")
      .def_property_readonly(
          "rate", [](const S& s) { return s.rate; }, "[Hz]")
      .def_property_readonly(
          "model", [](const S& s) { return s.model; }, "whose fields and shells it uses");
}

}  // namespace

SessionPtr make_session(std::shared_ptr<PyModel> model, const Definition& of) {
  auto made = std::make_shared<PySession>();
  made->hands = of.hands.size(), made->bodies = of.bodies.size(), made->rate = of.def.rate;
  made->states.resize(made->bodies);
  for (h6DeviceSample& sample : made->samples) sample = h6DefaultDeviceSample();
  for (std::size_t h = 0; h < made->hands && h < H6_MAX_HANDS; ++h)
    if (const auto body = static_cast<std::size_t>(of.hands[h]->body); body < of.bodies.size())
      made->samples[h].pose = of.bodies[body]->pose;
  made->session = of.with([&](const h6SessionDef& def) {
    return Session::make(
        [&](h6Error* error) { return h6CreateSession(model->get(), &def, error); });
  });
  made->model = std::move(model);
  return made;
}

void add_session(py::module_& m) {
  declare_rows();
  add_contacts(m);
  py::class_<PySession, SessionPtr> c(
      m, "Session",
      "Bodies, hands and their state. Threads that share one take turns, call by call; its arrays "
      "are views, which a step of another thread changes.");
  c.def(py::init([](std::shared_ptr<PyModel> model, const Definition& definition) {
          const Definition copy(definition);
          py::gil_scoped_release release;
          return make_session(std::move(model), copy);
        }),
        py::arg("model"), py::arg("definition"),
        "Each hand's sample begins where its body is, at rest.");
  add_steps(c);
  add_state(c);
}

}  // namespace hapsix::python
