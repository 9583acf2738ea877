/* SPDX-License-Identifier: MIT
 *
 * risorius.h: faces from DNA files in any program, C99.
 *
 *     risorius_face* face = NULL;
 *     risorius_instance* instance = NULL;
 *     float raw[400] = {0};
 *     if (risorius_open_file("face.dna", NULL, &face) != RISORIUS_OK ||
 *         risorius_create(face, 0, &instance) != RISORIUS_OK ||
 *         risorius_set(instance, RISORIUS_RAW_CONTROLS, 0, 1, raw) != RISORIUS_OK ||
 *         risorius_evaluate(instance) != RISORIUS_OK) {
 *       puts(risorius_last_error()->message);
 *     }
 *
 * Face and instance. A face is a DNA file, compiled once; it never changes. An instance is one
 * character in a scene: its controls, its LOD and its pose. Any number of instances can share a
 * face.
 *
 * Threads. Any number of threads may use a face at once, one thread at a time an instance. Each
 * thread has its own last error.
 *
 * Memory. The library owns the memory of every returned pointer: pointers of a face are valid until
 * risorius_close, of an instance until risorius_destroy, of the last error until the next failed
 * call of this thread. An instance keeps the compiled data of its face alive, so both may be closed
 * in any order. risorius_set and risorius_evaluate allocate no memory.
 *
 * Errors. A function that can fail returns a risorius_status, or NULL or 0; risorius_last_error
 * returns the details. No function throws. NULL, indices and counts out of range, and numbers that
 * are not finite are refused. Only successful calls write their outputs.
 *
 * Units and axes are the units and axes of the file: see risorius_skeleton. LOD 0 is the most
 * detailed.
 *
 * Arrays of vectors are planar, as in the file: float[3, n] is all x, then all y, then all z.
 */
#ifndef RISORIUS_H
#define RISORIUS_H

#include <stddef.h>
#include <stdint.h>

#if defined(RISORIUS_STATIC)
#define RISORIUS_API
#elif defined(_WIN32) && defined(RISORIUS_BUILDING)
#define RISORIUS_API __declspec(dllexport)
#elif defined(_WIN32)
#define RISORIUS_API __declspec(dllimport)
#else
#define RISORIUS_API __attribute__((visibility("default")))
#endif

/* Increases with every change that breaks compiled programs: a function or a field that is removed,
 * moved or redefined. It is also the number in the shared library's name. */
#define RISORIUS_ABI 1

#ifdef __cplusplus
extern "C" {
#endif

typedef struct risorius_face risorius_face;
typedef struct risorius_instance risorius_instance;

typedef enum risorius_status {
  RISORIUS_OK = 0,
  RISORIUS_BAD_ARGUMENT = 1,  /* a fault of the caller: NULL, an index, a number */
  RISORIUS_BAD_FILE = 2,      /* the bytes are no valid DNA file */
  RISORIUS_NOT_READABLE = 3,  /* the system cannot read the file */
  RISORIUS_TOO_LARGE = 4,     /* the file needs more than its size allows */
  RISORIUS_OUT_OF_MEMORY = 5, /* the system has no more memory */
  RISORIUS_INTERNAL = 6       /* a fault of this library */
} risorius_status;

typedef struct risorius_error {
  risorius_status status;
  const char* code;    /* the error in one word, e.g. "truncated", "invalid_index" */
  const char* file;    /* the path given to risorius_open_file; "" in other errors */
  const char* field;   /* in the file, e.g. "behavior.joint_groups[3].values", or the argument */
  int64_t offset;      /* byte offset in the file; -1 if unknown */
  const char* message; /* one sentence with the expected and the found value */
} risorius_error;

/* The lists of a face; a uint32_t, so that any other number can be refused. */
enum {
  RISORIUS_RAW_CONTROLS = 0, /* inputs of the face: usually 0 at rest, 1 full */
  RISORIUS_GUI_CONTROLS = 1, /* sliders of the rig's panel; a table maps them to raw controls */
  RISORIUS_JOINTS = 2,
  RISORIUS_SHAPES = 3, /* blend shape channels: weights of the meshes' targets */
  RISORIUS_MAPS = 4,   /* animated maps: weights of wrinkle and colour textures, 0 to 1 */
  RISORIUS_MESHES = 5,
  RISORIUS_LODS = 6 /* levels of detail; they have no names */
};
typedef uint32_t risorius_list;

/* Flags of risorius_options. */
enum {
  RISORIUS_GEOMETRY = 1,         /* read the meshes; otherwise they only have names */
  RISORIUS_TARGETS = 2,          /* also read the targets of the meshes; needs RISORIUS_GEOMETRY */
  RISORIUS_WITHOUT_NETWORKS = 4, /* do not read neural networks */
  RISORIUS_WITHOUT_SOLVERS = 8,  /* do not read RBF solvers */
  RISORIUS_QUATERNIONS = 16,     /* joint rotations as quaternions instead of Euler angles */
  RISORIUS_FLOAT16 = 32          /* joint matrices as float16: half the memory, 11 exact bits */
};

/* The parts of the file to read. All zero, or NULL for the struct: every LOD, no geometry. */
typedef struct risorius_options {
  uint32_t flags;            /* RISORIUS_GEOMETRY to RISORIUS_FLOAT16 */
  uint32_t lod_count;        /* 0: all */
  const uint16_t* lods;      /* uint16[lod_count], each LOD once and present in the file; items
                                that no kept LOD uses are removed, and
                                all indices refer to the rest */
  uint32_t mesh_count;       /* 0: all; otherwise needs RISORIUS_GEOMETRY */
  const char* const* meshes; /* names of the meshes to read, UTF-8 */
} risorius_options;

/* The joints in the neutral pose, and the units and axes of the file. */
typedef struct risorius_skeleton {
  uint32_t joint_count;
  uint32_t stride;           /* numbers per joint: 9, or 10 with RISORIUS_QUATERNIONS */
  const uint16_t* parents;   /* uint16[joints]; a root is its own parent */
  const float* neutral;      /* float[joints, stride]: tx ty tz, rx ry rz or qx qy qz qw, sx sy sz,
                                relative to the parent */
  uint32_t translation_unit; /* 0 centimetres, 1 metres */
  uint32_t rotation_unit;    /* of Euler angles: 0 degrees, 1 radians */
  uint32_t axes[3];          /* directions of x, y, z: 0 left 1 right 2 up 3 down 4 front 5 back */
  uint32_t rotation_order;   /* 0 xyz 1 xzy 2 yxz 3 yzx 4 zxy 5 zyx; the first axis turns first */
  int32_t rotation_signs[3]; /* 1 or -1 */
} risorius_skeleton;

/* A mesh in the neutral pose. A corner of a polygon has a position, a texture coordinate and a
 * normal by index.
 */
typedef struct risorius_mesh {
  uint32_t vertex_count, uv_count, normal_count, corner_count, polygon_count, target_count;
  const float* positions;           /* float[3, vertices] */
  const float* uvs;                 /* float[2, uvs] */
  const float* normals;             /* float[3, normals] */
  const uint32_t* corner_positions; /* uint32[corners] */
  const uint32_t* corner_uvs;       /* uint32[corners] */
  const uint32_t* corner_normals;   /* uint32[corners] */
  const uint32_t* polygon_begins;   /* uint32[polygons + 1] into polygon_corners; NULL: none */
  const uint32_t* polygon_corners;  /* the corners of all polygons, back to back */
  const uint32_t* skin_begins;      /* uint32[vertices + 1] into weights, joints; NULL: no skin */
  const float* skin_weights;
  const uint16_t* skin_joints;
} risorius_mesh;

/* A shape of a mesh: position + value of its channel * delta. */
typedef struct risorius_target {
  uint32_t shape; /* the channel, an index of RISORIUS_SHAPES */
  uint32_t count;
  const uint32_t* vertices; /* uint32[count] */
  const float* deltas;      /* float[3, count] */
} risorius_target;

/* ---- the library ---- */

/* RISORIUS_ABI of the loaded library; a program must not use a library with another number. */
RISORIUS_API uint32_t risorius_abi(void);

/* The version of the library, e.g. "0.1.0". */
RISORIUS_API const char* risorius_version(void);

/* Error of the last failed call of this thread; never NULL. */
RISORIUS_API const risorius_error* risorius_last_error(void);

/* ---- faces ---- */

/* Reads and compiles a DNA file.
 * In:    path     UTF-8
 *        options  NULL: every LOD, no geometry
 * Out:   face     close it with risorius_close
 * Fails: RISORIUS_NOT_READABLE, RISORIUS_BAD_FILE, RISORIUS_TOO_LARGE, RISORIUS_BAD_ARGUMENT (an
 *        option, a LOD or a mesh does not exist) */
RISORIUS_API risorius_status risorius_open_file(const char* path, const risorius_options* options,
                                                risorius_face** face);

/* Reads and compiles a DNA file from its bytes, which may be freed afterwards. Otherwise as
 * risorius_open_file. */
RISORIUS_API risorius_status risorius_open_memory(const void* bytes, size_t size,
                                                  const risorius_options* options,
                                                  risorius_face** face);

/* Closes a face; its instances remain valid. NULL has no effect. */
RISORIUS_API void risorius_close(risorius_face* face);

/* Number of items in a list. 0 and an error for an unknown list. */
RISORIUS_API uint32_t risorius_count(const risorius_face* face, risorius_list list);

/* The name of an item as in the file, UTF-8. NULL and an error if the list has no such item or no
 * names. */
RISORIUS_API const char* risorius_name(const risorius_face* face, risorius_list list,
                                       uint32_t index);

/* The joints, shapes, maps or meshes of a LOD.
 * Out: items  uint16[count], indices of the list; count */
RISORIUS_API risorius_status risorius_lod_items(const risorius_face* face, risorius_list list,
                                                uint32_t lod, const uint16_t** items,
                                                uint32_t* count);

RISORIUS_API risorius_status risorius_get_skeleton(const risorius_face* face,
                                                   risorius_skeleton* skeleton);

/* The arrays of a mesh. A mesh that was not read, because of the options, has counts of 0. */
RISORIUS_API risorius_status risorius_get_mesh(const risorius_face* face, uint32_t mesh,
                                               risorius_mesh* out);

/* One target of a mesh. In: target  below the mesh's target_count */
RISORIUS_API risorius_status risorius_get_target(const risorius_face* face, uint32_t mesh,
                                                 uint32_t target, risorius_target* out);

/* ---- instances ---- */

/* Behaviour of an instance over time. RISORIUS_SETTLED: a pose depends on the controls alone.
 * RISORIUS_LATENT: networks, solvers and correctives read outputs of later stages from the previous
 * evaluation, as in the reference implementation. */
enum { RISORIUS_SETTLED = 0, RISORIUS_LATENT = 1 };
typedef uint32_t risorius_timing;

/* Creates an instance at rest, at LOD 0.
 * Out: instance  destroy it with risorius_destroy */
RISORIUS_API risorius_status risorius_create(const risorius_face* face, risorius_timing timing,
                                             risorius_instance** instance);

/* Destroys an instance. NULL has no effect. */
RISORIUS_API void risorius_destroy(risorius_instance* instance);

/* Sets controls `first` to `first + count - 1` of RISORIUS_RAW_CONTROLS or RISORIUS_GUI_CONTROLS.
 * GUI controls immediately change the raw controls in their table: the last call wins.
 * In:    values  float[count], finite. Raw controls are not clamped: above 1 joints extrapolate.
 * Fails: RISORIUS_BAD_ARGUMENT, and nothing is set */
RISORIUS_API risorius_status risorius_set(risorius_instance* instance, risorius_list list,
                                          uint32_t first, uint32_t count, const float* values);

/* Sets the LOD of later evaluations. */
RISORIUS_API risorius_status risorius_set_lod(risorius_instance* instance, uint32_t lod);

/* Computes the pose of the present controls at the present LOD, for risorius_values. */
RISORIUS_API risorius_status risorius_evaluate(risorius_instance* instance);

/* Values of an instance: controls as set, all others from the last evaluation, or 0 before the
 * first one. Joints are deltas added to neutral, float[joints, stride] (quaternions: multiplied
 * with neutral); a scale of 0 means no scaling. Items that the LOD does not use are 0
 * (quaternions: 0 0 0 1).
 *
 * In:  list   RISORIUS_RAW_CONTROLS to RISORIUS_MAPS
 *
 * Out: count  number of floats; may be NULL
 *
 * The result is NULL, with an error, if the instance is NULL or the list is another one. An empty
 * list is no error, but its pointer must not be read. */
RISORIUS_API const float* risorius_values(const risorius_instance* instance, risorius_list list,
                                          uint32_t* count);

#ifdef __cplusplus
}
#endif

#endif
