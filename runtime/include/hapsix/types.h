// SPDX-License-Identifier: Apache-2.0
/* types.h - the data of models and sessions: fields, shells, bodies, hands, reports.
 *
 * Units are SI (m, kg, s, N, rad). Every pose is that of the MESH FRAME: it carries a point of the
 * mesh file, in metres, to the world. Quaternions are (w, x, y, z), unit.
 */
#ifndef HAPSIX_TYPES_H
#define HAPSIX_TYPES_H

#include <stdbool.h>

#include "base.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct h6Vec3 { double x, y, z; } h6Vec3;
typedef struct h6Quat { double w, x, y, z; } h6Quat;
typedef struct h6Pose { h6Vec3 p; h6Quat q; } h6Pose;
typedef struct h6Velocity { h6Vec3 linear; h6Vec3 angular; } h6Velocity; /* world frame           */
typedef struct h6Wrench { h6Vec3 force; h6Vec3 torque; } h6Wrench; /* world frame; torque about the
                                                                      body's centre of mass        */

/* ---- immutable data: fields and shells -------------------------------------------------------- */

/* A signed distance field in sparse bricks of 8 x 8 x 8 nodes. Node (i,j,k) lies at
 * origin + voxel_size * (i,j,k); brick (a,b,c) holds nodes 8a..8a+7 and so on. Distances are in
 * metres, negative inside the obstacle. Arrays are read while h6CreateModel runs, never after. */
typedef struct h6FieldDef {
  h6Vec3         origin;       /* node (0,0,0), mesh frame                                     [m] */
  double         voxel_size;   /* node spacing, > 0                                            [m] */
  int32_t        bricks[3];    /* bricks along x, y, z; each 1 .. 256 (2048 nodes)                 */
  const int32_t* brick_index;  /* (bz x by x bx), x fastest: row in `samples`, or -1: no brick     */
  const float*   samples;      /* (brick_count x 8 x 8 x 8), x fastest: signed distance        [m] */
  size_t         brick_count;
  const float*   far_grid;     /* (bz+1 x by+1 x bx+1), x fastest, at nodes (8a, 8b, 8c): its sign
                                  is the side, its magnitude is at most the true distance      [m] */
  double         band;         /* every unit cell with a point nearer than this to the surface
                                  has all of its 8 nodes in bricks                             [m] */
  const int32_t* part;         /* (brick_count) nearest part of the mesh, or NULL                  */
  const int32_t* triangle;     /* (brick_count) nearest triangle of the mesh, -1: none; or NULL    */
  /* Finer samples in single cells where the voxel is too coarse (creases, thin walls). Cell (i,j,k)
   * of a brick lies between its nodes (i,j,k) and (i+1,j+1,k+1); the last ones end at nodes of the
   * next bricks. A cell keeps the brick's own samples, or has its own at half or quarter voxels, all
   * of its faces included. The field is continuous only if nodes on a face, edge or corner that a
   * coarser cell shares lie on that cell's interpolation. Wherever a voxel of a body or field is a
   * measure of depth or speed, that is the finest spacing of nodes.                              */
  const int32_t* refined;      /* (brick_count) row in `fine_index`, -1: not refined; or NULL      */
  const int32_t* fine_index;   /* (refined_count x 8 x 8 x 8), x fastest, one a cell: 0: the brick's
                                  own samples; h > 0: row h - 1 of `halves`; q < 0: row -1 - q of
                                  `quarters`                                                       */
  size_t         refined_count;
  const float*   halves;       /* (half_count x 3 x 3 x 3), x fastest: signed distance         [m] */
  size_t         half_count;
  const float*   quarters;     /* (quarter_count x 5 x 5 x 5), x fastest: signed distance      [m] */
  size_t         quarter_count;
  uint64_t reserved[8];
} h6FieldDef;

/* A reduced deformable: how the points of a shell move with r coordinates q, and what resists.
 * Barbic & James 2005 (reduced StVK), 2008 (haptics); METHOD.md, Sec. 10. Point i stands at
 *     p_i + sum_j q_j modes[i][j]                                                  mesh frame  [m]
 * and q obeys, since the modes are mass-orthonormal,
 *     q'' + (alpha + beta df/dq) q' + f(q) = forces on the modes
 *     f_i = sum_j P1[i][j] q_j + sum_{j<=k} P2[i][jk] q_j q_k + sum_{j<=k<=l} P3[i][jkl] q_j q_k q_l
 * in SI units (q in m sqrt(kg)). Pairs and triples stand in lexicographic order, row i contiguous.
 * Arrays are read while h6CreateModel runs, never after. */
#define H6_MAX_MODES 64
typedef struct h6DeformableDef {
  uint32_t      mode_count;  /* r, 1 .. H6_MAX_MODES                                               */
  const float*  modes;       /* (point_count x r x 3): displacement of each point for q_j = 1      */
  const float*  normal_modes;/* (point_count x r x 3): first derivative of each point's unit normal by
                                q_j, or NULL: from how neighbouring points move                    */
  const double* linear;      /* P1 (r x r)                                                         */
  const double* quadratic;   /* P2 (r x r(r+1)/2), or NULL: 0                                      */
  const double* cubic;       /* P3 (r x r(r+1)(r+2)/6), or NULL: 0                                 */
  double        alpha;       /* mass damping, 0 .. 1e6                                       [1/s] */
  double        beta;        /* stiffness damping, 0 .. 1e3                                    [s] */
  const float*  turn_modes;  /* (point_count x r x 3): turn of each point (half the curl of its
                                displacement) for q_j = 1 [rad], or NULL. With them displacements are
                                warped (Choi & Ko 2005): each is turned by the mean of the rotations
                                up to its point's turn, and that turns the normal. normal_modes,
                                quadratic and cubic must be NULL then                              */
  uint64_t reserved[7];
} h6DeformableDef;

/* A shell: the points that may touch. Points stand level by level (coarse first); a point belongs
 * to its own level and to all finer ones. Nodes are the sphere tree: row r of a level is the point
 * `node_point[r]` with the sphere, centred on that point, that holds all its descendants. The
 * children of a node are itself one level finer, and the new points nearest to it. Nodes of one
 * level stand together, coarse first; those of the last level are all the points, radius 0. */
typedef struct h6ShellDef {
  size_t          point_count;
  const float*    x; const float* y; const float* z;    /* (point_count) mesh frame           [m] */
  const float*    nx; const float* ny; const float* nz; /* (point_count) INWARD unit normals      */
  const uint32_t* source;          /* (point_count) source triangle, or NULL                      */
  uint32_t        level_count;     /* 1 .. 32                                                     */
  const uint32_t* level_first;     /* (level_count + 1) rows of each level in the node arrays     */
  const uint32_t* node_point;      /* (nodes)                                                     */
  const float*    node_radius;     /* (nodes)                                                 [m] */
  const uint32_t* node_first_child;/* (nodes) row in the node arrays; 0 in the last level         */
  const uint32_t* node_child_count;/* (nodes) 0 in the last level                                 */
  const h6DeformableDef* deformable; /* how the shell bends, or NULL: it is rigid. A body with a shell
                                      that bends is fixed, has no field, and touches the field of one
                                      body: METHOD.md, Sec. 10                                     */
  uint64_t reserved[7];
} h6ShellDef;

typedef struct h6ModelDef {
  const h6FieldDef* fields; size_t field_count;
  const h6ShellDef* shells; size_t shell_count;
  h6Allocator       allocator; /* zero: the C library's                                           */
  /* Runs body(context, i) for i in 0..count-1 on any threads, returns when all are done. Used only
   * to convert fields. NULL: the engine's own workers. */
  void (*parallel_for)(void* user, size_t count, void (*body)(void* context, size_t i), void* context);
  void* parallel_user;
  uint64_t reserved[8];
} h6ModelDef;

/* ---- what moves -------------------------------------------------------------------------------- */

typedef struct h6BodyDef {
  h6Pose     pose;       /* mesh frame -> world at the start                                       */
  h6Velocity velocity;   /* of the centre of mass, at the start                                    */
  bool       fixed;      /* never moves; mass and inertia are not read                             */
  double     mass;       /* 1e-6 .. 1e6                                                      [kg]  */
  h6Vec3     com;        /* centre of mass, mesh frame                                        [m]  */
  double     inertia[6]; /* xx yy zz xy xz yz about com, mesh axes; all zero: from the shell's
                            points, each an equal share of the mass                       [kg m^2] */
  int32_t    shell;      /* index into the model's shells, or -1: none                             */
  int32_t    field;      /* index into the model's fields, or -1: none                             */
  bool       translation_only; /* 3-DoF: never turns, feels no torque (Xu & Barbic 2016, Sec. 3.1) */
  uint64_t reserved[8];
} h6BodyDef;

/* A shell body that may touch a field body. Both may move. */
typedef struct h6PairDef { int32_t shell_body; int32_t field_body; uint64_t reserved[2]; } h6PairDef;

/* How contact stiffness is shared out. The paper: Xu & Barbic 2016, IEEE Trans. Haptics. */
typedef enum h6Method {
  H6_METHOD_NONE = 0, /* every contact has the full stiffness                                      */
  H6_METHOD_GLOBAL,   /* McNeely 1999: n0/n once there are n0 contacts                             */
  H6_METHOD_CLUSTER,  /* Kim 2003: near contacts are merged into one                               */
  H6_METHOD_GAUSS3,   /* the paper's Eq. 6-9: density of normals                                   */
  H6_METHOD_GAUSS6,   /* the paper's Eq. 10-12: density of normals plus density of torque directions*/
  H6_METHOD_ROBUST,   /* product density, weighted by depth, contacts facing away dropped          */
  H6_METHOD_SERIES,   /* the whole penalty in series with one spring: net stiffness <= series_c k  */
  H6_METHOD_FIRM,     /* `series` whose contacts share their stiffness on the Gauss map and stiffen with
                         depth: holds the depth below x_max, net stiffness <= series_c k           */
  H6_METHOD_COUNT
} h6Method;

/* Pieces that can be added one by one. The first three turn the paper's methods into `robust`; the
 * others are options of the Gauss methods (gauss3, gauss6, robust). Other methods ignore them all. */
enum {
  H6_PIECE_FACING = 1u << 0, /* contacts whose normal opposes the field's gradient fade out        */
  H6_PIECE_DEPTH  = 1u << 1, /* contacts enter the density in proportion to their depth            */
  H6_PIECE_PRODUCT = 1u << 2, /* gauss6: product of the two hats instead of their sum              */
  H6_PIECE_CLUSTER = 1u << 3, /* weights on clusters: see H6_METHOD_CLUSTER                        */
  H6_PIECE_GEODESIC = 1u << 4, /* angles instead of chords: 2 asin(|dN|/2), the same for T         */
  H6_PIECE_HANDLES = 1u << 5, /* Eq. 13: T = r x F/|F|, in units of the body's radius              */
  H6_PIECE_PRINTED = 1u << 6  /* Eq. 8 as printed: w = phi / largest phi                           */
};

/* What becomes of an overlap at the start. Parts in their designed place overlap their neighbours:
 * press fits, threads, gaps of zero, coarse triangles (METHOD.md, Sec. 7). */
typedef enum h6Fit {
  H6_FIT_RELIEVE = 0, /* the depth that a point has at the start is its zero, until it has once been
                         free; deeper than H6_DEEPEST_FIT voxels it takes no part until then       */
  H6_FIT_TIGHT        /* depths count in full from the first frame on                              */
} h6Fit;
/* Deeper than this, or than its band, a field holds bounds and no distances              [voxel] */
#define H6_DEEPEST_FIT 3.0

typedef struct h6ContactDef {
  h6Method method;          /* default firm                                                        */
  uint32_t pieces;          /* H6_PIECE_*; robust always has the first three                       */
  double   stiffness;       /* k of one contact; 0: from mass, weight and voxel of the bodies that may
                               touch (h6StiffnessFor), at least 1e4; h6WeighContacts, which knows
                               none of these, takes 1e4                                     [N/m]  */
  double   damping;         /* beta, >= 0: damping of a contact is beta * its stiffness       [s]  */
  double   global_n0;       /* `global`: number of contacts above which they share, >= 1           */
  double   epsilon;         /* `gauss3`, `gauss6`: half-width of the density hat, (0, 2]           */
  double   epsilon_normal;  /* `robust`: half-width of the hat over normals, (0, 2]                */
  double   epsilon_torque;  /* `robust`: half-width of the hat over torque directions, (0, 2]      */
  double   torque_length;   /* l0: lever arms below it count less; 0: one voxel for robust, none for
                               the others                                                     [m]  */
  double   series_c;        /* `series`, `firm`: c in (2, 1e6]; the net stiffness is at most c k           */
  double   firmness;        /* `firm`: rho, stiffness of one direction of contact inside the common
                               spring, in units of k, from half a voxel of depth on; 1 .. 1e6      */
  double   firmness_shallow; /* `firm`: the same near the surface, 1 .. 1e6                        */
  double   margin_voxels;   /* `series`, `firm`: no point farther than this takes part before it
                               touches, 0 .. 2 voxels of the field                                 */
  double   cluster_voxels;  /* `cluster`, `+cluster`: contacts nearer than this are one, in (0.01,
                               100] voxels                                                         */
  bool     passivity;       /* observe the work of each shell body's contacts and damp energy that
                               they would generate (Hannaford & Ryu 2002)                          */
  h6Fit    fit;             /* of sessions; h6WeighContacts does not read it                       */
  double   fit_offset;      /* play: of sessions, every depth counts less by this, 0 .. 3 voxels of
                               each field                                                     [m]  */
  double   friction;        /* mu: Coulomb friction with stiction, 0 .. 10; default 0: none, but
                               for `firm`, where pushes that lean always rub; of sessions,
                               h6WeighContacts does not read it. METHOD.md, Sec. 3 and 9           */
  uint64_t reserved[8];
} h6ContactDef;

typedef enum h6Integrator { H6_IMPLICIT = 0, H6_EXPLICIT } h6Integrator;
typedef enum h6Gradient {
  H6_SYMMETRIC = 0, /* J J^T, no geometric term: symmetric, solved by LDL^T                        */
  H6_EXACT          /* J J_g^T and the geometric term: pivoted LU                                  */
} h6Gradient;

/* The coupling between a hand's manipulandum and its body (METHOD.md, Sec. 4). */
typedef enum h6CouplingMode {
  H6_COUPLING_DYNAMIC = 0, /* a body with mass on a damped spring                                  */
  H6_COUPLING_STATIC,      /* quasi-static: each frame one step towards the pose in which coupling and
                              contacts balance; no mass (Wan & McNeely 2003)                       */
  H6_COUPLING_DIRECT       /* none: the body is where the hand is, the hand feels its contacts     */
} h6CouplingMode;

/* Virtual coupling: Wan & McNeely 2003; saturation: Barbic & James 2008 (METHOD.md, Sec. 4). Where a
 * comment gives a meaning for 0, the engine derives the value. */
typedef struct h6CouplingDef {
  h6CouplingMode mode;
  double stiffness;           /* k_VC                                                       [N/m]  */
  double rotational_stiffness;/* 0: stiffness times the larger of (30 voxels)^2 and the mean inertia
                                 over the mass                                          [N m/rad]  */
  double damping_ratio;       /* 0 .. 10; dynamic: of the coupled body, 1 is critical, with a least
                                 damper for light bodies (METHOD.md, Sec. 4); static: the damper is
                                 this times three frames times the spring                          */
  double max_depth_voxels;    /* x_max: the largest force is k * x_max, in voxels of the body      */
  double max_force;           /* 0: contact stiffness * x_max                                 [N]  */
  double max_torque;          /* 0: max_force * the body's radius                           [N m]  */
  double max_step_voxels;     /* static: no point moves farther than this in a frame, > 0; default
                                 half a voxel                                                      */
  uint64_t reserved[4];
} h6CouplingDef;

/* Between a device and the scene: indexing and scaling of motion (METHOD.md, Sec. 4). Scales of 0 are
 * not valid; h6DefaultHandDef passes everything through unchanged. */
typedef struct h6HandFilterDef {
  double   motion_scale;    /* metres in the scene per metre of the device, > 0; default 1         */
  double   rotation_scale;  /* the same for angles, > 0; default 1                                 */
  double   force_scale;     /* newtons at the device per newton in the scene, torque alike, > 0;
                               default 1; power is kept when all three scales are equal            */
  uint32_t clutch_buttons;  /* indexing: while one of these is down the device moves alone and the
                               hand feels nothing; 0: no clutch                                    */
  bool     relative;        /* the first sample takes the body where it is, wherever the device is */
  uint64_t reserved[4];
} h6HandFilterDef;

enum { H6_IMPEDANCE = 1u << 0, H6_ADMITTANCE = 1u << 1, H6_PSEUDO_ADMITTANCE = 1u << 2 };

/* The safety chain of a hand's output (METHOD.md, "The safety chain"). It is always on. These settings
 * can only make it tighter than the device's own ratings: a loop refuses values above them.
 * h6DefaultSafetyDef fills in the defaults that are not 0. */
typedef struct h6SafetyDef {
  double   max_force;       /* 0: the device's rating                                         [N]  */
  double   max_torque;      /* 0: the device's rating                                       [N m]  */
  double   max_force_rate;  /* slew limit; 0: the device's                                  [N/s]  */
  double   max_torque_rate; /* slew limit; 0: the device's                                [N m/s]  */
  double   max_power;       /* most power to the hand; 0: max_force at 1 m/s                  [W]  */
  double   max_speed;       /* admittance modes: of the motion sent; 0: the device's        [m/s]  */
  double   derate_speed;    /* speed of the hand above which the wrench falls linearly, to zero at
                               cut_speed; 0: half of cut_speed                              [m/s]  */
  double   cut_speed;       /* speed of the hand at which the output latches at zero; 0: twice the
                               device's max_velocity, at most 5; a turn counts at 0.2 m     [m/s]  */
  double   soft_start;      /* from zero to the whole output after every arming, pose jump and
                               recovery, 0 .. 10; default 0.1                                 [s]  */
  double   decay_time;      /* from the whole output to zero, 0.001 .. 0.02; default 0.02     [s]  */
  double   pose_jump;       /* a sample is a jump when it is farther from the last one than this plus
                               the way of a hand at 5 m/s in a frame, or turned by half a radian;
                               0.001 .. 0.05; default 0.02                                    [m]  */
  double   freeze_time;     /* equal samples for this long mean that the device is frozen, at most
                               1; 0: the device's                                             [s]  */
  uint32_t dead_man_buttons;/* nothing is rendered unless one of these is held; 0: none            */
  uint64_t reserved[8];
} h6SafetyDef;

/* How an arm and the engine exchange data (Xu & Barbic 2016, Fig. 13; METHOD.md, Sec. 4):
 *   impedance         in: pose; out: wrench
 *   admittance        in: wrench of the person (a force sensor); out: pose and velocity of the body;
 *                     the coupling's bounds limit the wrench; its springs are not used
 *   pseudo-admittance in: wrench of the driver's own coupling; out: pose and velocity of a
 *                     manipulandum with mass, which the virtual coupling ties to the body */
typedef struct h6HandDef {
  int32_t         body;     /* index of the body that moves with this hand                         */
  uint32_t        mode;     /* H6_IMPEDANCE (default), H6_ADMITTANCE or H6_PSEUDO_ADMITTANCE       */
  h6CouplingDef   coupling;
  h6HandFilterDef filter;
  double          manipulandum_mass;  /* pseudo-admittance, > 0; its inertia is the body's in the
                                         same ratio as the masses; default 0.1               [kg]  */
  double          driver_stiffness;   /* pseudo-admittance: of the driver's coupling, so that the   */
  double          driver_damping;     /* step can be implicit in it; 0: not known      [N/m, N s/m] */
  double          admittance_damping; /* admittance: of the free body, >= 0; 0: derived; rotation:
                                         see METHOD.md                                     [N s/m] */
  bool            passivity;          /* observe the energy that leaves through this hand; damp the
                                         wrench, or send a share of it, where more would leave
                                         than was put in (Hannaford & Ryu 2002)                    */
  uint32_t        delay_frames;       /* for passivity: a command acts on the hand at most this many
                                         frames late, 0 .. 2; default 0                            */
  bool            delay_known;        /* ... and always exactly this many                          */
  h6SafetyDef     safety;   /* of the output to the device                                         */
  uint64_t reserved[8];
} h6HandDef;

typedef struct h6SessionDef {
  const h6BodyDef* bodies; size_t body_count;  /* at least 1; the storage is reserved once         */
  const h6PairDef* pairs;  size_t pair_count;  /* 0: every moving shell against every other field;
                                                  two moving bodies: the shell of the first listed.
                                                  Each takes some 90 bytes, and 10^7 some 7 s at the
                                                  creation                                         */
  const h6HandDef* hands;  size_t hand_count;  /* at most H6_MAX_HANDS                             */
  h6ContactDef contact;
  h6Integrator integrator;
  h6Gradient   gradient;
  double       rate;          /* frames per second, 100 .. 10000                             [Hz]  */
  h6Vec3       gravity;       /* default 0: the arm carries the part                      [m/s^2]  */
  size_t       max_contacts;  /* per shell body; storage is reserved once, for no more than 8 contacts
                                 of a point                                                        */
  size_t       max_pairs;     /* pairs of a shell body and a field body that are near each other at a
                                 time; storage is reserved once. 0: all that there can be, at most
                                 4096 and 16 for each shell body (H6_PAIRS_LEFT_OUT)               */
  uint32_t     max_substeps;  /* most steps that a frame takes so that no point near a field moves
                                 farther than a fifth of a voxel in a step, 1 .. 64; default
                                 16. 1: one step, however far it goes. The explicit integrator takes
                                 as many as hands and one wall need. METHOD.md, Sec. 8             */
  bool         net_stiffness; /* report the extreme eigenvalues of the weighted stiffness          */
  uint32_t     threads;       /* that share a frame's work, 1 .. 64: the calling one and resident
                                 helpers, or `tasks`; at most one for each core helps              */
  h6Tasks      tasks;         /* the program's own helpers; zero: the engine's                     */
  double       frame_budget_us; /* anytime mode: a step that would take longer samples fewer points
                                   (H6_COARSE). It reads the clock, so runs differ in the points they
                                   leave out; h6SetCoarse repeats one. 0: off; always off in virtual
                                   time [us]                                                       */
  h6Allocator  allocator;
  struct h6Workers* workers;  /* batch.h: only h6StepMany with these workers steps the session, and it
                                 borrows their scratch, most of its memory; `threads` must be 1. NULL,
                                 the default: anybody steps it                                     */
  uint64_t     reserved[15];
} h6SessionDef;

#define H6_MAX_HANDS 8

/* Contacts of any simulator, for h6WeighContacts: one row per contact, x y z next to each other. All in
 * one frame of reference; arms and torques are about one point, the body's centre of mass. */
typedef struct h6ContactArrays {
  size_t            count;
  const float*      normals;   /* (count x 3) unit, the direction in which the contact pushes       */
  const float*      arms;      /* (count x 3) r: from the centre of mass to the contact        [m]  */
  const float*      depths;    /* (count) > 0 inside; <= 0: only `series` reads them           [m]  */
  const float*      gradients; /* (count x 3) g: unit, out of the obstacle, or NULL: the normals    */
  const h6Velocity* velocity;  /* of the body against the obstacle at the centre of mass, or NULL: 0*/
  h6Gradient        form;      /* of the derivatives                                                */
  void*             scratch;   /* h6WeighScratchBytes(count) bytes, any alignment, or NULL: one heap
                                  block of that size, freed before the return                       */
  size_t            scratch_bytes;
  uint64_t reserved[8];
} h6ContactArrays;

/* ---- what can be read -------------------------------------------------------------------------- */

typedef struct h6BodyState { h6Pose pose; h6Velocity velocity; } h6BodyState;

/* The contacts of one shell body in the last frame, without friction. Columns of `count` rows, valid
 * until the next step. World frame. With clusters a row is a cluster: means weighted by depth, and the
 * index of its deepest point. Under `series` and `firm`, rows with depth <= 0 are about to touch: weight 0,
 * load >= 0. Depths are those that push: relief and fit_offset are taken off, and under `firm` the error
 * of trilinear interpolation too, less than 0.025 voxel. */
typedef struct h6Contacts {
  size_t          count;
  const float*    depth;                         /* penetration depth, > 0 inside             [m]  */
  const float*    nx; const float* ny; const float* nz; /* inward unit normal; `firm`: of the push  */
  const float*    gx; const float* gy; const float* gz; /* unit gradient of the field, outward     */
  const float*    rx; const float* ry; const float* rz; /* arm: from the centre of mass; of a shell that
                                                    bends: from that of the body it touches   [m]  */
  const float*    tx; const float* ty; const float* tz; /* torque direction T                      */
  const float*    weight;                        /* share of the stiffness; `series` and `firm`:
                                                    load / depth, >= 0, may exceed 1               */
  const uint32_t* point;                         /* index into the shell's points                  */
  const int32_t*  field_body;                    /* the body whose field it touches                */
  const float*    load;                          /* force along N over k: weight * depth; `series`:
                                                    lambda, which includes damping            [m]  */
  uint64_t reserved[8];
} h6Contacts;

/* Stages of a frame, in order. */
typedef enum h6Stage {
  H6_STAGE_TRAVERSE = 0, /* sphere tree against the field                                          */
  H6_STAGE_CONTACTS,     /* depth, normal, gradient, arm of each contact                           */
  H6_STAGE_WEIGHTS,
  H6_STAGE_WRENCH,       /* and its 6x6 gradient                                                   */
  H6_STAGE_COUPLING,
  H6_STAGE_INTEGRATE,
  H6_STAGE_OUTPUT,       /* safety chain                                                           */
  H6_STAGE_COUNT
} h6Stage;
#define H6_MAX_STAGES 12
H6_API const char* h6StageName(h6Stage stage);

typedef struct h6FrameReport {
  uint64_t frame;                     /* 0 for the first                                           */
  h6Status status;
  uint32_t contacts;                  /* points that touch, over all shell bodies                  */
  double   max_depth;                 /* depth of the deepest contact, without its relief and the
                                         fit_offset; 0 without contacts                       [m]  */
  double   max_depth_voxels;          /* the same in voxels of its field: its finest node spacing  */
  double   stage_us[H6_MAX_STAGES];
  double   frame_us;
  uint64_t state_hash;                /* of poses, velocities and deformations after the step, of the
                                         samples, and of the friction springs where there is friction */
  uint32_t series_iterations;         /* `series`: most Newton steps of any shell body             */
  double   series_residual;           /* `series`: largest gradient left, over c * the largest e   */
  /* With h6SessionDef.net_stiffness: extreme eigenvalues of S J^T w k J S over all shell bodies'
   * contacts, S = diag(1,1,1,1/L,1/L,1/L) with L the body's radius: the net stiffness of all
   * contacts together. 0 without contacts.                                                 [N/m]  */
  double   net_stiffness_min, net_stiffness_max;
  double   passivity_energy;          /* E of the port with the least: < 0 where energy was made; 0
                                         when no port is observed                             [J]  */
  double   helper_start_us, helper_us;/* threads 2: the helper's first slice after the frame began, and
                                         its time in slices                                        */
  uint32_t helper_slices;
  uint32_t coarse_pairs;             /* number of pairs, the last ones, that were traversed coarsely */
  uint32_t coarse_points;            /* points of each sixteen that were sampled there: 1, 2, 4, 8;
                                        0: 1, and a shell body kept only its 64 deepest contacts    */
  double   missed_depth_voxels;      /* H6_COARSE: no point that was left out is deeper, as long as
                                        none is deeper than its field's band                        */
  double   fit_depth_voxels;         /* true depth of the deepest point, relieved or not, of the pairs
                                        with relief or a fit_offset; 0: there are none              */
  uint32_t substeps;                 /* steps that the frame took. `contacts` and h6GetContacts are
                                        those of the last one, depths are the deepest of all        */
  uint64_t reserved[8];
} h6FrameReport;

/* The overlap of a shell body with a field body at the start: the points inside the field. */
typedef struct h6Overlap {
  int32_t  shell_body, field_body;
  uint32_t points;
  uint32_t relieved;     /* of these, points that have relief now                                  */
  double   depth;        /* of the deepest point                                              [m]  */
  double   depth_voxels; /* the same in voxels of the field                                        */
  uint32_t deepest;      /* the deepest: its row among those of h6GetOverlapPoints                 */
  uint64_t reserved[2];
} h6Overlap;
typedef struct h6OverlapPoint {
  int32_t  shell_body, field_body;
  uint32_t point;          /* index into the shell's points                                        */
  int32_t  part, triangle; /* of the field's mesh, as h6NameContacts gives them; -1: not known     */
  h6Vec3   position;       /* at the start, world frame                                       [m]  */
  double   depth;          /* at the start                                                    [m]  */
  double   depth_voxels;   /* the same in voxels of the field                                      */
  double   relief;         /* what does not count of its depth now; 0: it has been free; INFINITY:
                              it started too deep and takes no part until it is free          [m]  */
  uint64_t reserved[2];
} h6OverlapPoint;

#ifdef __cplusplus
}
#endif
#endif
