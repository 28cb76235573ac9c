// SPDX-License-Identifier: Apache-2.0
// bind_definitions.cpp - bodies, hands, contact rules and sessions as Python objects whose
// attributes are the members of the C definitions. hapsix.h and types.h have ranges and defaults.
#include "python/bindings.h"

namespace hapsix::python {
namespace {

// A class of definitions: T(name=value, ...).
template <class T, class Make>
py::class_<T, std::shared_ptr<T>> definition(py::module_& m, const char* name, const char* doc,
                                             Make make) {
  py::class_<T, std::shared_ptr<T>> made(m, name, doc);
  made.def(py::init([make](const py::kwargs& values) {
             auto object = std::make_shared<T>(make());
             const py::object self = py::cast(object);
             for (const auto& [key, value] : values) {
               if (!py::hasattr(self, key))
                 throw py::type_error(std::string(py::str(py::type::of(self).attr("__name__"))) +
                                      " has no attribute '" + std::string(py::str(key)) + "'");
               py::setattr(self, key, value);
             }
             return object;
           }),
           "Begins with the defaults; keywords set attributes.");
  return made;
}

template <class Class, class Owner, class T>
void numbers(Class& c, const char* name, T Owner::*member, const char* doc) {
  c.def_property(
      name, [member](const Owner& o) { return tuple_of(o.*member); },
      [member](Owner& o, const Numbers<T>& v) { o.*member = struct_of<T>(v); }, doc);
}

using Names = std::vector<std::pair<const char*, int>>;
template <class Class, class Owner, class T>
void choice(Class& c, const char* name, T Owner::*member, Names names, const char* doc) {
  c.def_property(
      name,
      [member, names](const Owner& o) -> std::string {
        for (const auto& [known, value] : names)
          if (static_cast<int>(o.*member) == value) return known;
        return "";
      },
      [member, names, name](Owner& o, const std::string& wanted) {
        std::string all;
        for (const auto& [known, value] : names) {
          if (wanted == known) return void(o.*member = static_cast<T>(value));
          all += (all.empty() ? "'" : ", '") + std::string(known) + "'";
        }
        throw py::value_error(std::string(name) + " is '" + wanted + "', not one of " + all);
      },
      doc);
}

std::string method_of(const h6ContactDef& contact) {
  static constexpr std::pair<std::uint32_t, const char*> pieces[] = {
      {H6_PIECE_FACING, "facing"},   {H6_PIECE_DEPTH, "depth"},       {H6_PIECE_PRODUCT, "product"},
      {H6_PIECE_CLUSTER, "cluster"}, {H6_PIECE_GEODESIC, "geodesic"}, {H6_PIECE_HANDLES, "handles"},
      {H6_PIECE_PRINTED, "printed"}};
  const char* name = h6MethodName(contact.method);
  std::string text = name ? name : "";
  for (const auto& [bit, piece] : pieces)
    if (contact.pieces & bit) text += std::string("+") + piece;
  return text;
}

void set_method(h6ContactDef& contact, const std::string& name) {
  if (h6MethodFromName(name.c_str(), &contact.method, &contact.pieces) == 0) return;
  std::string known;
  for (int i = 0; i < H6_METHOD_COUNT; ++i)
    known += std::string(i ? ", '" : "'") + h6MethodName(static_cast<h6Method>(i)) + "'";
  throw py::value_error("method is '" + name + "', not one of " + known);
}

void add_contact(py::module_& m) {
  using T = h6ContactDef;
  auto c = definition<T>(m, "Contact", "How contacts push and share their stiffness.",
                         h6DefaultContactDef);
  c.def_property("method", method_of, set_method,
                 "Weight rule: 'firm' (default), 'robust', 'series', 'global', ...");
  c.def_readwrite("stiffness", &T::stiffness, "k of one contact [N/m]; 0: derived");
  c.def_readwrite("damping", &T::damping, "beta: damping over stiffness [s]");
  c.def_readwrite("global_n0", &T::global_n0, "`global`: contacts above which they share");
  c.def_readwrite("epsilon", &T::epsilon, "`gauss3`, `gauss6`: half-width of the hat, (0, 2]");
  c.def_readwrite("epsilon_normal", &T::epsilon_normal, "`robust`: half-width over normals");
  c.def_readwrite("epsilon_torque", &T::epsilon_torque, "`robust`: half-width over torques");
  c.def_readwrite("torque_length", &T::torque_length, "l0 [m]; 0: derived");
  c.def_readwrite("series_c", &T::series_c, "`series`, `firm`: net stiffness is at most c k");
  c.def_readwrite("firmness", &T::firmness, "`firm`: rho, in units of k");
  c.def_readwrite("firmness_shallow", &T::firmness_shallow, "`firm`: rho near the surface");
  c.def_readwrite("margin_voxels", &T::margin_voxels,
                  "`series`, `firm`: takes part before it touches");
  c.def_readwrite("cluster_voxels", &T::cluster_voxels,
                  "`cluster`: contacts nearer are one [voxel]");
  c.def_readwrite("passivity", &T::passivity, "damp energy that contacts would make");
  choice(c, "fit", &T::fit, {{"relieve", H6_FIT_RELIEVE}, {"tight", H6_FIT_TIGHT}},
         "overlap at the start: 'relieve' (default) or 'tight'");
  c.def_readwrite("fit_offset", &T::fit_offset, "play [m]");
  c.def_readwrite("friction", &T::friction, "mu, 0 .. 10");
}

void add_body(py::module_& m) {
  using T = h6BodyDef;
  auto c = definition<T>(m, "Body", "What moves, or stands fast.", h6DefaultBodyDef);
  numbers(c, "pose", &T::pose, "(7,) mesh frame -> world at the start [m]");
  numbers(c, "velocity", &T::velocity,
          "(6,) of the centre of mass, linear and angular [m/s, rad/s]");
  c.def_readwrite("fixed", &T::fixed, "never moves");
  c.def_readwrite("mass", &T::mass, "[kg]");
  numbers(c, "com", &T::com, "(3,) centre of mass, mesh frame [m]");
  c.def_property(
      "inertia",
      [](const T& b) -> NumberTuple {
        return py::make_tuple(b.inertia[0], b.inertia[1], b.inertia[2], b.inertia[3], b.inertia[4],
                              b.inertia[5]);
      },
      [](T& b, const std::array<double, 6>& v) { std::copy(v.begin(), v.end(), b.inertia); },
      "(6,) xx yy zz xy xz yz about com [kg m^2]; zeros: from the shell's points");
  c.def_readwrite("shell", &T::shell, "index into the model's shells; -1: none");
  c.def_readwrite("field", &T::field, "index into the model's fields; -1: none");
  c.def_readwrite("translation_only", &T::translation_only, "3-DoF: never turns");
}

void add_coupling(py::module_& m) {
  using T = h6CouplingDef;
  auto c = definition<T>(m, "Coupling", "The virtual coupling between a hand and its body.",
                         [] { return h6DefaultCouplingDef(); });
  choice(c, "mode", &T::mode,
         {{"dynamic", H6_COUPLING_DYNAMIC},
          {"static", H6_COUPLING_STATIC},
          {"direct", H6_COUPLING_DIRECT}},
         "'dynamic' (default), 'static' or 'direct'");
  c.def_readwrite("stiffness", &T::stiffness, "k_VC [N/m]");
  c.def_readwrite("rotational_stiffness", &T::rotational_stiffness, "[N m/rad]; 0: derived");
  c.def_readwrite("damping_ratio", &T::damping_ratio, "1 is critical");
  c.def_readwrite("max_depth_voxels", &T::max_depth_voxels,
                  "largest force is k times this [voxel]");
  c.def_readwrite("max_force", &T::max_force, "[N]; 0: derived");
  c.def_readwrite("max_torque", &T::max_torque, "[N m]; 0: derived");
  c.def_readwrite("max_step_voxels", &T::max_step_voxels, "static: most way in a frame [voxel]");
}

void add_safety(py::module_& m) {
  using T = h6SafetyDef;
  auto c =
      definition<T>(m, "Safety", "The safety chain of a hand's output. 0: the device's rating.",
                    h6DefaultSafetyDef);
  c.def_readwrite("max_force", &T::max_force, "[N]");
  c.def_readwrite("max_torque", &T::max_torque, "[N m]");
  c.def_readwrite("max_force_rate", &T::max_force_rate, "slew limit [N/s]");
  c.def_readwrite("max_torque_rate", &T::max_torque_rate, "slew limit [N m/s]");
  c.def_readwrite("max_power", &T::max_power, "[W]");
  c.def_readwrite("max_speed", &T::max_speed, "admittance [m/s]");
  c.def_readwrite("derate_speed", &T::derate_speed, "[m/s]");
  c.def_readwrite("cut_speed", &T::cut_speed, "[m/s]");
  c.def_readwrite("soft_start", &T::soft_start, "[s]");
  c.def_readwrite("decay_time", &T::decay_time, "[s]");
  c.def_readwrite("pose_jump", &T::pose_jump, "[m]");
  c.def_readwrite("freeze_time", &T::freeze_time, "[s]");
  c.def_readwrite("dead_man_buttons", &T::dead_man_buttons, "bits");
}

void add_hand(py::module_& m) {
  using F = h6HandFilterDef;
  auto f = definition<F>(m, "Filter", "Between a device and the scene: scales and clutch.",
                         [] { return h6DefaultHandDef().filter; });
  f.def_readwrite("motion_scale", &F::motion_scale, "metres in the scene per metre of the device");
  f.def_readwrite("rotation_scale", &F::rotation_scale, "the same for angles");
  f.def_readwrite("force_scale", &F::force_scale, "newtons at the device per newton in the scene");
  f.def_readwrite("clutch_buttons", &F::clutch_buttons, "bits");
  f.def_readwrite("relative", &F::relative, "the first sample takes the body where it is");
  using T = h6HandDef;
  auto c = definition<T>(m, "Hand", "What holds a body.", h6DefaultHandDef);
  c.def_readwrite("body", &T::body, "index of the body that moves with this hand");
  choice(c, "mode", &T::mode,
         {{"impedance", H6_IMPEDANCE},
          {"admittance", H6_ADMITTANCE},
          {"pseudo-admittance", H6_PSEUDO_ADMITTANCE}},
         "'impedance' (default), 'admittance' or 'pseudo-admittance'");
  c.def_readwrite("coupling", &T::coupling, "Coupling");
  c.def_readwrite("filter", &T::filter, "Filter");
  c.def_readwrite("safety", &T::safety, "Safety");
  c.def_readwrite("manipulandum_mass", &T::manipulandum_mass, "[kg]");
  c.def_readwrite("driver_stiffness", &T::driver_stiffness, "[N/m]");
  c.def_readwrite("driver_damping", &T::driver_damping, "[N s/m]");
  c.def_readwrite("admittance_damping", &T::admittance_damping, "[N s/m]");
  c.def_readwrite("passivity", &T::passivity, "observe the energy that leaves through this hand");
  c.def_readwrite("delay_frames", &T::delay_frames, "0 .. 2");
  c.def_readwrite("delay_known", &T::delay_known, "always exactly so many");
}

// A member of the C definition inside a Definition.
template <class T>
auto get(T h6SessionDef::*member) {
  return [member](const Definition& d) { return d.def.*member; };
}
template <class T>
auto set(T h6SessionDef::*member) {
  return [member](Definition& d, T value) { d.def.*member = value; };
}

template <class Class, class T>
void member(Class& c, const char* name, T h6SessionDef::*of, const char* doc) {
  c.def_property(name, get(of), set(of), doc);
}

void add_definition(py::module_& m) {
  using D = Definition;
  auto c = definition<D>(m, "Definition", "A session's bodies, hands, pairs and settings.",
                         [] { return D(); });
  c.def_property(
      "bodies", [](const D& d) -> Typed<py::tuple, "Tuple[Body, ...]"> {
        return py::tuple(py::cast(d.bodies));
      },
      [](D& d, std::vector<std::shared_ptr<h6BodyDef>> v) { d.bodies = std::move(v); },
      "tuple of Body, which may be changed; assign a new sequence for others");
  c.def_property(
      "hands", [](const D& d) -> Typed<py::tuple, "Tuple[Hand, ...]"> {
        return py::tuple(py::cast(d.hands));
      },
      [](D& d, std::vector<std::shared_ptr<h6HandDef>> v) { d.hands = std::move(v); },
      "tuple of Hand, at most 8");
  c.def_property(
      "pairs", [](const D& d) -> Typed<py::tuple, "Tuple[Tuple[int, int], ...]"> {
        py::tuple out(d.pairs.size());
        for (std::size_t i = 0; i < d.pairs.size(); ++i)
          out[i] = py::make_tuple(d.pairs[i][0], d.pairs[i][1]);
        return out;
      },
      [](D& d, std::vector<std::array<std::int32_t, 2>> v) { d.pairs = std::move(v); },
      "tuple of (shell body, field body); empty: every moving shell against every other field");
  c.def_property(
      "contact", [](D& d) -> h6ContactDef& { return d.def.contact; },
      [](D& d, const h6ContactDef& contact) { d.def.contact = contact; },
      py::return_value_policy::reference_internal, "Contact");
  c.def_property(
      "implicit", [](const D& d) { return d.def.integrator == H6_IMPLICIT; },
      [](D& d, bool yes) { d.def.integrator = yes ? H6_IMPLICIT : H6_EXPLICIT; }, "default True");
  c.def_property(
      "exact_gradient", [](const D& d) { return d.def.gradient == H6_EXACT; },
      [](D& d, bool yes) { d.def.gradient = yes ? H6_EXACT : H6_SYMMETRIC; }, "default False");
  c.def_property(
      "gravity", [](const D& d) { return tuple_of(d.def.gravity); },
      [](D& d, const Numbers<h6Vec3>& v) { d.def.gravity = struct_of<h6Vec3>(v); }, "(3,) [m/s^2]");
  member(c, "rate", &h6SessionDef::rate, "frames a second [Hz]");
  member(c, "max_contacts", &h6SessionDef::max_contacts, "room, per shell body");
  member(c, "max_pairs", &h6SessionDef::max_pairs, "room for pairs that are near; 0: derived");
  member(c, "max_substeps", &h6SessionDef::max_substeps, "most steps of a frame, 1 .. 64");
  member(c, "net_stiffness", &h6SessionDef::net_stiffness, "report it in each frame");
  member(c, "threads", &h6SessionDef::threads, "that share a frame's work, 1 .. 64");
  member(c, "frame_budget_us", &h6SessionDef::frame_budget_us, "anytime mode [us]; 0: off");
}

}  // namespace

Definition::Definition(const h6SessionDef& from) : def(from) {
  for (std::size_t i = 0; i < from.body_count; ++i)
    bodies.push_back(std::make_shared<h6BodyDef>(from.bodies[i]));
  for (std::size_t i = 0; i < from.hand_count; ++i)
    hands.push_back(std::make_shared<h6HandDef>(from.hands[i]));
  for (std::size_t i = 0; i < from.pair_count; ++i)
    pairs.push_back({from.pairs[i].shell_body, from.pairs[i].field_body});
  def.bodies = nullptr, def.hands = nullptr, def.pairs = nullptr;
}

Definition::Definition(const Definition& from) : pairs(from.pairs), def(from.def) {
  for (const auto& body : from.bodies) bodies.push_back(std::make_shared<h6BodyDef>(*body));
  for (const auto& hand : from.hands) hands.push_back(std::make_shared<h6HandDef>(*hand));
}

void add_definitions(py::module_& m) {
  add_contact(m);
  add_body(m);
  add_coupling(m);
  add_safety(m);
  add_hand(m);
  add_definition(m);
}

}  // namespace hapsix::python
