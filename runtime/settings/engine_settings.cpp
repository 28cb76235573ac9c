// SPDX-License-Identifier: Apache-2.0
// engine_settings.cpp - the rows of the engine's definitions.
#include "runtime/settings/engine_settings.h"

#include "hapsix/hapsix.h"

namespace h6 {
namespace {

using Kind = SettingKind;

constexpr double kAllBits = 4294967295.0;

constexpr Setting kPoseRows[] = {
    plain<&h6Pose::p>("p", Kind::vec3, "m", "position of the mesh frame"),
    plain<&h6Pose::q>("q", Kind::quaternion, "", "orientation w x y z; default 1 0 0 0")};
constexpr SettingTable kPose = settings_of("h6Pose", kPoseRows);

constexpr Setting kBodyRows[] = {
    flag<&h6BodyDef::fixed>("fixed", "the body never moves; its mass and inertia are not read"),
    number<&h6BodyDef::mass>("mass", "kg", 0.1, between(1e-6, 1e6), "of the whole body"),
    flag<&h6BodyDef::translation_only>("translation_only",
                                       "3-DoF: the body never turns and feels no torque"),
    plain<&h6BodyDef::com>("com", Kind::vec3, "m", "centre of mass, mesh frame"),
    plain<&h6BodyDef::inertia>("inertia", Kind::inertia, "kg m^2",
                               "xx yy zz xy xz yz about com, mesh axes; all zero: from the points "
                               "of the shell, each an equal share of the mass"),
    object<&h6BodyDef::pose>("pose", kPose, "mesh frame to world at the start")};
constexpr SettingTable kBody = settings_of("h6BodyDef", kBodyRows);

constexpr Choice kMethods[] = {{"none", H6_METHOD_NONE},       {"global", H6_METHOD_GLOBAL},
                               {"cluster", H6_METHOD_CLUSTER}, {"gauss3", H6_METHOD_GAUSS3},
                               {"gauss6", H6_METHOD_GAUSS6},   {"robust", H6_METHOD_ROBUST},
                               {"series", H6_METHOD_SERIES},   {"firm", H6_METHOD_FIRM}};
constexpr Choice kPieces[] = {{"facing", H6_PIECE_FACING},     {"depth", H6_PIECE_DEPTH},
                              {"product", H6_PIECE_PRODUCT},   {"cluster", H6_PIECE_CLUSTER},
                              {"geodesic", H6_PIECE_GEODESIC}, {"handles", H6_PIECE_HANDLES},
                              {"printed", H6_PIECE_PRINTED}};

constexpr Choice kFits[] = {{"relieve", H6_FIT_RELIEVE}, {"tight", H6_FIT_TIGHT}};

constexpr Setting method_row(Setting row) {
  row.kind = Kind::method;
  return row;
}

constexpr Setting kContactRows[] = {
    method_row(choice<&h6ContactDef::method>(
        "method", kMethods, H6_METHOD_FIRM,
        "none, global, cluster, gauss3, gauss6, robust, series or firm; the Gauss methods and "
        "robust "
        "also with pieces: +facing, +depth, +product, +cluster, +geodesic, +handles, +printed")),
    number<&h6ContactDef::stiffness>(
        "stiffness", "N/m", 0, between(0, 1e9),
        "k, the stiffness of one contact alone; 0: from mass, weight and voxel, at least 1e4"),
    number<&h6ContactDef::damping>("damping", "s", 1e-3, between(0, 1),
                                   "beta, the damping of a contact is beta times its stiffness"),
    number<&h6ContactDef::global_n0>(
        "global_n0", "", 10, between(1, 1e6),
        "global: number of contacts from which the stiffness is shared"),
    number<&h6ContactDef::epsilon>("epsilon", "", 0.01, above(0, 2),
                                   "gauss3, gauss6: half-width of the density hat"),
    number<&h6ContactDef::epsilon_normal>("epsilon_normal", "", 0.05, above(0, 2),
                                          "robust, firm: half-width of the hat over normals"),
    number<&h6ContactDef::epsilon_torque>(
        "epsilon_torque", "", 1, above(0, 2),
        "robust, firm: half-width of the hat over torque directions"),
    number<&h6ContactDef::torque_length>("torque_length", "m", 0, not_negative(kNoLimit),
                                         "l0, lever arms below it count for less; 0: one voxel for "
                                         "robust and firm, none for the others"),
    number<&h6ContactDef::series_c>("series_c", "", 4, above(2, 1e6),
                                    "series, firm: the net stiffness is at most this times k"),
    number<&h6ContactDef::firmness>(
        "firmness", "", 23, between(1, 1e6),
        "firm: stiffness of one direction of contact inside the common spring, in units of k, from "
        "half a voxel of depth on"),
    number<&h6ContactDef::firmness_shallow>("firmness_shallow", "", 4, between(1, 1e6),
                                            "firm: the same near the surface"),
    number<&h6ContactDef::margin_voxels>(
        "margin_voxels", "voxel", 0.25, between(0, 2),
        "series, firm: no point farther than this takes part before it touches"),
    number<&h6ContactDef::cluster_voxels>(
        "cluster_voxels", "voxel", 0.5, above(0.01, 100),
        "cluster, +cluster: contacts nearer than this are one contact"),
    flag<&h6ContactDef::passivity>(
        "passivity", "observe the work of the contacts and damp the energy that they would make"),
    quiet(choice<&h6ContactDef::fit>(
        "fit", kFits, H6_FIT_RELIEVE,
        "where parts overlap at the start; relieve: the depth that a point has there does not "
        "push until the point has once been free; tight: every depth pushes")),
    quiet(number<&h6ContactDef::fit_offset>(
        "fit_offset", "m", 0, not_negative(kNoLimit),
        "play: every depth counts less by this, at most 3 voxels of each field")),
    quiet(number<&h6ContactDef::friction>("friction", "", 0, between(0, 10),
                                          "mu, the coefficient of Coulomb friction with stiction; "
                                          "0: none, but where pushes of firm lean"))};
constexpr SettingTable kContact = settings_of("h6ContactDef", kContactRows);

constexpr Choice kCouplingModes[] = {{"dynamic", H6_COUPLING_DYNAMIC},
                                     {"static", H6_COUPLING_STATIC},
                                     {"direct", H6_COUPLING_DIRECT}};
constexpr Setting kCouplingRows[] = {
    choice<&h6CouplingDef::mode>(
        "mode", kCouplingModes, H6_COUPLING_DYNAMIC,
        "dynamic: a body with mass on a damped spring; static: each frame one step towards "
        "balance, without mass; direct: no coupling, the body is where the hand is"),
    number<&h6CouplingDef::stiffness>("stiffness", "N/m", 1e3, above(0, 1e9),
                                      "k_VC, of the virtual coupling"),
    number<&h6CouplingDef::rotational_stiffness>("rotational_stiffness", "N m/rad", 0,
                                                 between(0, 1e9),
                                                 "0: stiffness times the larger of (30 voxels) "
                                                 "squared and inertia over mass"),
    number<&h6CouplingDef::damping_ratio>(
        "damping_ratio", "", 1, between(0, 10),
        "dynamic: of the coupled body, 1 is critical, light bodies get more; static: the damper is "
        "this times three frames times the spring"),
    number<&h6CouplingDef::max_depth_voxels>(
        "max_depth_voxels", "voxel", 0.5, above(0, 1000),
        "x_max: the largest force is the contact stiffness times this depth"),
    number<&h6CouplingDef::max_force>("max_force", "N", 0, between(0, 1e6),
                                      "largest force; 0: from max_depth_voxels"),
    number<&h6CouplingDef::max_torque>("max_torque", "N m", 0, between(0, 1e6),
                                       "largest torque; 0: max_force times the body's radius"),
    number<&h6CouplingDef::max_step_voxels>("max_step_voxels", "voxel", 0.5, above(0, 1000),
                                            "static: no point moves farther than this in a frame")};
constexpr SettingTable kCoupling = settings_of("h6CouplingDef", kCouplingRows);

constexpr Setting kFilterRows[] = {
    number<&h6HandFilterDef::motion_scale>(
        "motion_scale", "", 1, between(1e-6, 1e6),
        "metres in the scene for one metre of the device; a path is the device's"),
    number<&h6HandFilterDef::rotation_scale>("rotation_scale", "", 1, between(1e-6, 1e6),
                                             "radians in the scene for one radian of the device"),
    number<&h6HandFilterDef::force_scale>(
        "force_scale", "", 1, between(1e-6, 1e6),
        "newtons at the device for one newton in the scene; torques alike"),
    flag<&h6HandFilterDef::relative>(
        "relative", "the first sample takes the body where it is, wherever the device is"),
    whole<&h6HandFilterDef::clutch_buttons>(
        "clutch_buttons", 0, between(0, kAllBits),
        "bits: while one of these buttons is down the device moves alone; 0: none")};
constexpr SettingTable kFilter = settings_of("h6HandFilterDef", kFilterRows);

constexpr Setting kSafetyRows[] = {
    number<&h6SafetyDef::max_force>("max_force", "N", 0, between(0, 1e4),
                                    "largest force; 0: the device's rating"),
    number<&h6SafetyDef::max_torque>("max_torque", "N m", 0, between(0, 1e3),
                                     "largest torque; 0: the device's rating"),
    number<&h6SafetyDef::max_force_rate>("max_force_rate", "N/s", 0, between(0, 1e7),
                                         "slew limit of the force; 0: the device's"),
    number<&h6SafetyDef::max_torque_rate>("max_torque_rate", "N m/s", 0, between(0, 1e6),
                                          "slew limit of the torque; 0: the device's"),
    number<&h6SafetyDef::max_power>("max_power", "W", 0, between(0, 1e5),
                                    "largest power given to the hand; 0: max_force at 1 m/s"),
    number<&h6SafetyDef::max_speed>("max_speed", "m/s", 0, between(0, 100),
                                    "admittance modes: of the motion sent; 0: the device's"),
    number<&h6SafetyDef::derate_speed>(
        "derate_speed", "m/s", 0, between(0, 100),
        "of the hand: from here on the force falls linearly, to nothing at cut_speed; 0: half of "
        "cut_speed"),
    number<&h6SafetyDef::cut_speed>(
        "cut_speed", "m/s", 0, between(0, 100),
        "of the hand: the output becomes zero, latched; 0: twice the device's max_velocity, at "
        "most 5 m/s"),
    number<&h6SafetyDef::soft_start>("soft_start", "s", 0.1, between(0, 10),
                                     "from nothing to the whole output after arming"),
    number<&h6SafetyDef::decay_time>("decay_time", "s", 0.02, between(0.001, 0.02),
                                     "from the whole output to nothing in trouble"),
    number<&h6SafetyDef::pose_jump>("pose_jump", "m", 0.02, between(0.001, 0.05),
                                    "a sample farther from the last one than this is a jump"),
    number<&h6SafetyDef::freeze_time>(
        "freeze_time", "s", 0, between(0, 1),
        "samples that stay the same for so long mean a frozen device; 0: the device's"),
    whole<&h6SafetyDef::dead_man_buttons>(
        "dead_man_buttons", 0, between(0, kAllBits),
        "bits: nothing is rendered unless one of these buttons is held; 0: none")};
constexpr SettingTable kSafety = settings_of("h6SafetyDef", kSafetyRows);

constexpr Choice kHandModes[] = {{"impedance", H6_IMPEDANCE},
                                 {"admittance", H6_ADMITTANCE},
                                 {"pseudo-admittance", H6_PSEUDO_ADMITTANCE}};
constexpr Setting kHandRows[] = {
    choice<&h6HandDef::mode>(
        "mode", kHandModes, H6_IMPEDANCE,
        "impedance: pose in, wrench out; admittance: the person's wrench in, pose out; "
        "pseudo-admittance: the wrench of the driver's own coupling in, the manipulandum's pose "
        "out"),
    object<&h6HandDef::filter>("", kFilter, "indexing and scaling of motion"),
    number<&h6HandDef::manipulandum_mass>("manipulandum_mass", "kg", 0.1, between(1e-6, 1e6),
                                          "pseudo-admittance: of what the hand holds"),
    number<&h6HandDef::driver_stiffness>("driver_stiffness", "N/m", 0, between(0, 1e5),
                                         "pseudo-admittance: of the driver's coupling; 0: the "
                                         "arm's own, not known to the engine"),
    number<&h6HandDef::driver_damping>("driver_damping", "N s/m", 0, between(0, 50),
                                       "pseudo-admittance: of the driver's coupling"),
    number<&h6HandDef::admittance_damping>("admittance_damping", "N s/m", 0, between(0, 1e6),
                                           "admittance: of the free body; 0: derived"),
    flag<&h6HandDef::passivity>(
        "passivity", "observe the energy that leaves through this hand and damp what was not paid"),
    quiet(whole<&h6HandDef::delay_frames>(
        "delay_frames", 0, between(0, 2),
        "for passivity: the device applies a command at most this many frames late")),
    flag<&h6HandDef::delay_known>("delay_known", "the delay is always exactly delay_frames"),
    quiet(object<&h6HandDef::safety>(
        "safety", kSafety,
        "limits of what goes to the device, each at most the device's own rating"))};
constexpr SettingTable kHand = settings_of("h6HandDef", kHandRows);

constexpr Choice kIntegrators[] = {{"implicit", H6_IMPLICIT}, {"explicit", H6_EXPLICIT}};
constexpr Choice kGradients[] = {{"symmetric", H6_SYMMETRIC}, {"exact", H6_EXACT}};
constexpr Setting kSessionRows[] = {
    choice<&h6SessionDef::integrator>("integrator", kIntegrators, H6_IMPLICIT,
                                      "of the bodies' motion; explicit is for comparison"),
    choice<&h6SessionDef::gradient>("gradient", kGradients, H6_SYMMETRIC,
                                    "symmetric: J J^T, solved by LDL^T; exact: J J_g^T and the "
                                    "geometric term, solved by pivoted LU"),
    number<&h6SessionDef::rate>("rate", "Hz", 1000, between(100, 10000), "frames per second"),
    plain<&h6SessionDef::gravity>("gravity", Kind::vec3, "m/s^2",
                                  "default 0: the arm carries the part"),
    whole<&h6SessionDef::max_contacts>(
        "max_contacts", 16384, between(1, 1e6),
        "of a shell body; storage is reserved once, up to 330 bytes each"),
    whole<&h6SessionDef::max_pairs>(
        "max_pairs", 0, between(0, 1e8),
        "pairs of bodies that are near each other at a time; storage is reserved once; 0: all that "
        "there can be, at most 4096 and 16 for each shell"),
    whole<&h6SessionDef::max_substeps>(
        "max_substeps", 16, between(1, 64),
        "a frame takes up to this many steps, as many as keep every point near a field from moving "
        "farther than a fifth of a voxel in one; explicit: as many as hands and one wall need"),
    flag<&h6SessionDef::net_stiffness>(
        "net_stiffness", "report the extreme stiffness of all contacts together in every frame"),
    whole<&h6SessionDef::threads>("threads", 1, between(1, 64),
                                  "the haptic thread and its helpers; more than the machine has "
                                  "cores only cost time"),
    number<&h6SessionDef::frame_budget_us>(
        "frame_budget_us", "us", 0, between(0, 1e6),
        "anytime mode: a frame that would take longer leaves out points; 0: never")};
constexpr SettingTable kSession = settings_of("h6SessionDef", kSessionRows);

constexpr Setting kLoopRows[] = {
    number<&h6LoopDef::duration>("duration", "s", 0, between(0, 1e9),
                                 "0: until the loop is stopped"),
    flag<&h6LoopDef::virtual_time>("virtual_time",
                                   "as fast as possible: the clock counts frames, the bits are the "
                                   "same"),
    flag<&h6LoopDef::realtime>("realtime", "ask for pinning, SCHED_FIFO and locked memory", true),
    whole<&h6LoopDef::core>("core", -1, {},
                            "the core that the haptic thread is pinned to; -1: the last one"),
    number<&h6LoopDef::spin_us>("spin_us", "us", 0, between(0, 1e4),
                                "poll the clock for so long before each deadline"),
    whole<&h6LoopDef::ring_frames>("ring_frames", 1000, between(0, 1e7),
                                   "records kept for a slow reader; 0: none"),
    whole<&h6LoopDef::ring_inputs>("ring_inputs", 0, between(0, 1e7),
                                   "frames beyond these of which the inputs are kept"),
    flag<&h6LoopDef::disarmed>("disarmed", "every output stays at zero until h6ArmLoop"),
    whole<&h6LoopDef::view_contacts>("view_contacts", 0, between(0, 1e6),
                                     "rows of contacts kept for a viewer; 0: no viewer")};
constexpr SettingTable kLoop = settings_of("h6LoopDef", kLoopRows);

}  // namespace

const SettingTable& pose_settings() { return kPose; }
const SettingTable& body_settings() { return kBody; }
const SettingTable& contact_settings() { return kContact; }
const SettingTable& coupling_settings() { return kCoupling; }
const SettingTable& hand_settings() { return kHand; }
const SettingTable& safety_settings() { return kSafety; }
const SettingTable& session_settings() { return kSession; }
const SettingTable& loop_settings() { return kLoop; }

std::span<const Choice> method_names() { return kMethods; }
std::span<const Choice> method_pieces() { return kPieces; }

const Setting& setting_named(const SettingTable& rows, const char* name) {
  const Setting* found = nullptr;
  each_setting(rows, nullptr, [&](const Setting& row, const void*) {
    if (std::strcmp(row.name, name) == 0) found = &row;
  });
  H6_ASSERT(found);
  return *found;
}

}  // namespace h6
