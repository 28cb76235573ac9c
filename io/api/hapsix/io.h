// SPDX-License-Identifier: Apache-2.0
/* io.h - meshes, baking, scenes and recordings: what the program hapsix does with files, for other
 * programs. A library of its own (hapsix::io, -lhapsix_io) on top of the engine.
 *
 *   h6ReadMesh -> h6BakeField, h6BakeShell -> h6FieldDef, h6ShellDef -> h6CreateModel
 *   h6ReadScene -> h6GetSceneModel, h6GetSceneSession -> h6CreateSession
 *   h6CreateRecorder -> h6RecordFrames -> h6FinishRecorder;   h6ReadRecording -> h6GetRecordingFrames
 *
 * Units are SI, poses and lengths as in types.h. A function that fails gives NULL or false and fills
 * `error`, which may be NULL; for a NULL object, a -1 or an index past the end it fails, or gives NULL,
 * zeros or the default. Destroy functions take NULL. Nothing is printed: what a bake repaired or doubts
 * goes to the handler of h6SetLogHandler. Any thread may call, and different threads may read one mesh,
 * field, shell or scene at a time; a recorder or a recording belongs to one thread at a time, never the
 * haptic one. Definitions grow as base.h says.
 *
 * Reading and baking take their memory from the C library, as do OpenVDB, Embree, HDF5 and TBB below
 * them, which offer no other way. A model and a session take theirs from the program's allocator:
 * h6ModelDef.allocator, h6SessionDef.allocator, or h6SceneDef.allocator for both.
 */
#ifndef HAPSIX_IO_H
#define HAPSIX_IO_H

#include "hapsix/hapsix.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum h6Unit { H6_METRES = 0, H6_MILLIMETRES, H6_CENTIMETRES, H6_INCHES } h6Unit;

/* Work over a second calls this now and then, on the thread that called the work, with `done` in
 * [0, 1]. Return false to cancel: the work ends soon, leaves nothing half done and fails with
 * H6_ERROR_CANCELLED. */
typedef bool (*h6Progress)(void* user, const char* what, double done);

/* ---- meshes ------------------------------------------------------------------------------------ */

typedef struct h6Mesh h6Mesh;

typedef struct h6MeshDef {
  const double*   vertices;        /* (vertex_count x 3) within 1e6                             [m] */
  size_t          vertex_count;
  const uint32_t* triangles;       /* (triangle_count x 3) rows of `vertices`                       */
  size_t          triangle_count;  /* > 0                                                           */
  const int32_t*  part;            /* (triangle_count) any numbers >= 0, or NULL: one part          */
  uint64_t        reserved[4];
} h6MeshDef;
H6_API h6MeshDef h6DefaultMeshDef(void);

/* Facts about a mesh. Edges are counted after equal vertices were made one. */
typedef struct h6MeshInfo {
  size_t   triangles, vertices, parts;
  size_t   duplicates, degenerate; /* triangles that occur before; that have no area               */
  size_t   open_edges, odd_edges;  /* with one face; with an odd number of faces                   */
  size_t   components;
  bool     closed;                 /* every edge has an even number of faces                       */
  h6Vec3   low, high;              /* the box around it                                        [m] */
  double   volume;                 /* signed; of a closed mesh                               [m^3] */
  uint64_t reserved[4];
} h6MeshInfo;

/* The arrays are copied and can be freed afterwards. */
H6_API h6Mesh*     h6CreateMesh(const h6MeshDef* def, h6Error* error);
/* STL, OBJ, PLY, glTF, COLLADA, each also as .gz. `unit` is that of a format that has none. */
H6_API h6Mesh*     h6ReadMesh(const char* file, h6Unit unit, h6Error* error);
/* The same from memory; the ending of `name` tells the format. */
H6_API h6Mesh*     h6ParseMesh(const void* bytes, size_t count, const char* name, h6Unit unit,
                               h6Error* error);
H6_API void        h6DestroyMesh(h6Mesh* mesh);
H6_API void        h6GetMesh(const h6Mesh* mesh, h6MeshInfo* out);
H6_API const char* h6GetPartName(const h6Mesh* mesh, int32_t part); /* NULL: there is none          */

/* ---- fields and shells -------------------------------------------------------------------------- */

typedef struct h6Field h6Field;
typedef struct h6Shell h6Shell;

typedef enum h6Sign {
  H6_SIGN_AUTO = 0, /* closed meshes as they are, others moved out by `offset`                      */
  H6_SIGN_FLOOD,    /* what the outside cannot reach is inside                                      */
  H6_SIGN_WINDING   /* a solid with cracks and holes is closed across them                          */
} h6Sign;

typedef struct h6FieldBakeDef {
  int32_t    voxels;      /* cells on the longest padded side, 16 .. 2048; default 256              */
  double     voxel_size;  /* > 0: instead of `voxels`                                           [m] */
  double     tolerance;   /* > 0: largest error near the surface, instead of both               [m] */
  double     offset;      /* how far the surface is moved out; < 0, the default: 0 of a closed mesh,
                             else 0.9 voxel                                                     [m] */
  h6Sign     sign;
  bool       hollow;      /* enclosed hollows stay empty; default: they are filled                  */
  double     seal;        /* > 0: closes holes of an open mesh up to this width                 [m] */
  double     weld;        /* welds open edges this near, where that closes the mesh, 0 .. 1 voxel   */
  double     band_voxels; /* samples on each side of the surface, 1 .. 8; default 3                 */
  uint32_t   threads;     /* 0: all; the result is the same for any number                          */
  bool       cache;       /* take it from, and keep it in, the cache on disk ($HAPSIX_CACHE, else
                             ~/.cache/hapsix); default false                                        */
  h6Progress progress;    /* or NULL                                                                */
  void*      user;
  uint64_t   reserved[8];
} h6FieldBakeDef;
H6_API h6FieldBakeDef h6DefaultFieldBakeDef(void);

typedef enum h6ShellFrom { H6_FROM_AUTO = 0, H6_FROM_TRIANGLES, H6_FROM_FIELD } h6ShellFrom;

typedef struct h6ShellBakeDef {
  size_t         points;  /* on the finest level, exactly, 1 .. 20000000; default 10000             */
  double         spacing; /* > 0: least distance of points, instead of `points`                 [m] */
  int32_t        levels;  /* 1 .. 16; default 7                                                     */
  uint64_t       seed;
  h6ShellFrom    surface; /* where points lie: on triangles (auto), or where the field is zero      */
  h6ShellFrom    normals; /* of the triangles (auto), or the gradient of the field                  */
  h6FieldBakeDef field;   /* of the field that finds what the outside reaches; its cache, progress and
                             threads count for the shell                                            */
  uint64_t       reserved[8];
} h6ShellBakeDef;
H6_API h6ShellBakeDef h6DefaultShellBakeDef(void);

H6_API h6Field* h6BakeField(const h6Mesh* mesh, const h6FieldBakeDef* def, h6Error* error);
H6_API h6Field* h6ReadField(const char* file, h6Error* error);                     /* .vdb          */
H6_API bool     h6WriteField(const h6Field* field, const char* file, h6Error* error);
H6_API void     h6DestroyField(h6Field* field);
/* For h6ModelDef.fields. It points into the field, which must live until h6CreateModel has returned. */
H6_API void     h6GetField(const h6Field* field, h6FieldDef* out);

H6_API h6Shell* h6BakeShell(const h6Mesh* mesh, const h6ShellBakeDef* def, h6Error* error);
H6_API h6Shell* h6ReadShell(const char* file, h6Error* error);                     /* .ply          */
H6_API bool     h6WriteShell(const h6Shell* shell, const char* file, h6Error* error);
H6_API void     h6DestroyShell(h6Shell* shell);
H6_API void     h6GetShell(const h6Shell* shell, h6ShellDef* out); /* as h6GetField                 */

/* ---- is a field right, and what do its walls hold ----------------------------------------------- */

typedef struct h6CheckDef {
  double     stiffness;   /* of a contact, for the pushes, > 0; default 1e4                   [N/m] */
  size_t     points;      /* places to compare at; default 20000                                    */
  bool       push;        /* push at the walls, which takes longest; default true                   */
  uint32_t   threads;     /* 0: all                                                                 */
  h6Progress progress;
  void*      user;
  uint64_t   reserved[8];
} h6CheckDef;
H6_API h6CheckDef h6DefaultCheckDef(void);

typedef struct h6CheckReport {
  bool     agrees;          /* distances, sides and far bounds are right                            */
  bool     drains;          /* the outside runs into the solid through cracks; no force holds there */
  h6Vec3   leak;            /* of these, the deepest place                                      [m] */
  double   worst_node;      /* largest error of a sample                                    [voxel] */
  double   worst_between;   /* of the interpolation between samples                         [voxel] */
  double   wall_hundredth, wall_median; /* thickness; a hundredth of the area is thinner        [m] */
  double   gap_hundredth, gap_median;   /* width of gaps; 0: none found                         [m] */
  size_t   pushed;          /* places that were pushed at; 0: none, so no force is known            */
  double   holding_force;   /* no push with this or less gets through; 0: a wall holds nothing  [N] */
  h6Vec3   weakest;         /* of these places                                                  [m] */
  uint64_t reserved[8];
} h6CheckReport;
/* Compares a field with its mesh by exact distances and rays. False: it could not be checked. */
H6_API bool h6CheckField(const h6Mesh* mesh, const h6Field* field, const h6CheckDef* def,
                         h6CheckReport* out, h6Error* error);

/* ---- scenes ------------------------------------------------------------------------------------ */

typedef struct h6Scene h6Scene;

typedef struct h6SceneDef {
  bool       outside;     /* the scene may name files outside its folder: only for scenes you trust */
  h6Progress progress;
  void*      user;
  h6Allocator allocator;  /* of its model, and of the session's definition; zero: the C library's   */
  uint64_t   reserved[5];
} h6SceneDef;
H6_API h6SceneDef h6DefaultSceneDef(void);

/* `name` is a scene file (.json) or a generated scene ("peg-in-hole"; `hapsix scene list`). Its assets
 * are read, or baked and kept in the cache. def NULL: the default. Fails for a scene whose parts are
 * not there. */
H6_API h6Scene*       h6ReadScene(const char* name, const h6SceneDef* def, h6Error* error);
H6_API void           h6DestroyScene(h6Scene* scene); /* after its sessions                         */
H6_API const h6Model* h6GetSceneModel(const h6Scene* scene);
/* Points into the scene. A program may change what it likes before h6CreateSession. */
H6_API void           h6GetSceneSession(const h6Scene* scene, h6SessionDef* out);
H6_API int32_t        h6FindBody(const h6Scene* scene, const char* name); /* -1: there is none      */
H6_API const char*    h6GetBodyName(const h6Scene* scene, int32_t body);  /* NULL: there is none    */
H6_API double         h6GetSceneDuration(const h6Scene* scene);                           /* [s]    */
/* Pose and velocity that a hand of the scene wants at `time` [s], on its path. False: no such hand, or
 * it has no path, or a time that is not a number; infinite times give the ends of the path. */
H6_API bool           h6SampleScenePath(const h6Scene* scene, int32_t hand, double time,
                                        h6DeviceSample* out);

/* ---- recordings -------------------------------------------------------------------------------- */

typedef struct h6Recorder h6Recorder;
typedef struct h6Recording h6Recording;

typedef struct h6RecorderDef {
  const h6Scene*      scene;    /* kept in the recording; or NULL                                       */
  const h6SessionDef* session;  /* of the run; NULL: the scene's. One of the two must be given          */
  const char*         program;  /* your program's name, or NULL                                         */
  bool                virtual_time;
  uint64_t            reserved[8];
} h6RecorderDef;
H6_API h6RecorderDef h6DefaultRecorderDef(void);

/* Records to `file` (.h5) by way of file.part, so a killed run loses at most half a second. Refuses a
 * file that is something else, and one that another run records to. */
H6_API h6Recorder* h6CreateRecorder(const char* file, const h6RecorderDef* def, h6Error* error);
/* Rows as h6ReadRecords gives them, or h6GetRecord. Call it at least every 50 ms, also with count 0.
 * Numbers that are not finite are recorded as they are. */
H6_API bool        h6RecordFrames(h6Recorder* recorder, const h6FrameRecord* rows, size_t count,
                                  h6Error* error);
/* The same with the shapes of bodies that bend: row i of `bends`, `modes` numbers, is q of all these
 * bodies after frame i, one body after another, as h6ReadRecordsWithBends gives them [m sqrt(kg)];
 * h6GetDeformation gives them after a step. NULL, or h6RecordFrames: NaN is recorded, not known. Refused
 * where the bodies of the recorder's scene do not bend by so many modes; without a scene, by none. */
H6_API bool        h6RecordFramesWithBends(h6Recorder* recorder, const h6FrameRecord* rows, size_t count,
                                           const double* bends, size_t modes, h6Error* error);
/* Makes the file. `summary`: one JSON object, or NULL. */
H6_API bool        h6FinishRecorder(h6Recorder* recorder, const char* summary, h6Error* error);
H6_API void        h6DestroyRecorder(h6Recorder* recorder); /* unfinished: the recording says so    */

typedef struct h6RecordingInfo {
  uint64_t    frames;
  double      rate;        /*                                                                  [Hz] */
  size_t      hands, events;
  bool        whole;       /* false: the run was killed; its frames up to then are here             */
  const char* scene;       /* JSON, or ""; valid as long as the recording                           */
  const char* program;
  const char* summary;     /* JSON, or ""                                                           */
  uint64_t    reserved[8];
} h6RecordingInfo;
typedef struct h6RecordingEvent { double time; const char* what; const char* detail; } h6RecordingEvent;

/* Opens a recording, or what a killed run left of one. A forked child reads a foreign file first,
 * since HDF5 crashes on some damaged ones. */
H6_API h6Recording* h6ReadRecording(const char* file, h6Error* error);
H6_API void         h6DestroyRecording(h6Recording* recording);
H6_API void         h6GetRecording(const h6Recording* recording, h6RecordingInfo* out);
/* Reads `count` frames from `first` on; fewer at the end. Returns how many; -1: `error` is filled. */
H6_API int64_t      h6GetRecordingFrames(h6Recording* recording, uint64_t first, h6FrameRecord* out,
                                         size_t count, h6Error* error);
/* A body that bends, of which the recording has q, in the order of bodies. False: there is none. Older
 * recordings have none. */
typedef struct h6RecordingBend {
  int32_t     body;        /* index in the scene or session                                         */
  const char* name;        /* of the body, or ""                                                    */
  size_t      modes;       /* r                                                                     */
  uint64_t    reserved[4];
} h6RecordingBend;
H6_API bool         h6GetRecordingBend(const h6Recording* recording, size_t bend,
                                       h6RecordingBend* out);
/* q of all these bodies in `count` frames from `first` on: (count x sum of r), one body after another
 * [m sqrt(kg)]; NaN where it is not known. Returns the rows; fewer at the end. -1: `error` is filled. */
H6_API int64_t      h6GetRecordingBends(h6Recording* recording, uint64_t first, double* out,
                                        size_t count, h6Error* error);
H6_API bool         h6GetRecordingEvent(const h6Recording* recording, size_t event,
                                        h6RecordingEvent* out); /* false: there is none             */

#ifdef __cplusplus
}
#endif
#endif
