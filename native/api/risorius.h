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
 * Face and instance. A face is what a file says, compiled once; it never changes. An instance is
 * one character on the stage: its controls, its level of detail and its pose. Any number of
 * instances share a face.
 *
 * Threads. A face may be used by any number of threads at once, an instance by one at a time. The
 * last error belongs to the thread.
 *
 * Memory. What a function gives as a pointer belongs to the library: of a face until
 * risorius_close, of an instance until risorius_destroy, of the last error until the next call of
 * this thread that fails. An instance keeps what it needs of its face: the two may end in any
 * order. risorius_set and risorius_evaluate take no memory.
 *
 * Errors. What can fail returns a risorius_status, or NULL or 0; risorius_last_error has the rest.
 * Nothing is thrown. NULL, indices and counts out of range and numbers that are not finite are
 * refused. Outputs are written only by calls that succeed.
 *
 * Units and axes are those of the file: see risorius_skeleton. LOD 0 is the most detailed.
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

/* Counted up with every change that a compiled program would notice: a function or a field that
 * goes, moves or changes its meaning. It is the number in the shared library's name. */
#define RISORIUS_ABI 1

#ifdef __cplusplus
extern "C" {
#endif

typedef struct risorius_face risorius_face;
typedef struct risorius_instance risorius_instance;

typedef enum risorius_status {
  RISORIUS_OK = 0,
  RISORIUS_BAD_ARGUMENT = 1,  /* the program is wrong: NULL, an index, a number */
  RISORIUS_BAD_FILE = 2,      /* the bytes are no sound DNA file */
  RISORIUS_NOT_READABLE = 3,  /* the system does not give the file */
  RISORIUS_TOO_LARGE = 4,     /* the file asks for more than its size allows */
  RISORIUS_OUT_OF_MEMORY = 5, /* the system has no more */
  RISORIUS_INTERNAL = 6       /* a mistake of this library */
} risorius_status;

typedef struct risorius_error {
  risorius_status status;
  const char* code;    /* what it is in one word, e.g. "truncated", "invalid_index" */
  const char* file;    /* the path as it was given; "" for bytes in memory */
  const char* field;   /* of the file, e.g. "behavior.joint_groups[3].values", or the argument */
  int64_t offset;      /* the byte of the file; -1 where it is not known */
  const char* message; /* one sentence: what was expected, what was found */
} risorius_error;

/* What a face has numbers or names of; a uint32_t, so that any number can be refused. */
enum {
  RISORIUS_RAW_CONTROLS = 0, /* what moves the face: mostly 0 rest, 1 full */
  RISORIUS_GUI_CONTROLS = 1, /* sliders of the rig's panel, which a table turns into raw controls */
  RISORIUS_JOINTS = 2,
  RISORIUS_SHAPES = 3, /* blend shape channels: weights of shapes of the meshes */
  RISORIUS_MAPS = 4,   /* animated maps: weights of wrinkle and colour textures, 0 to 1 */
  RISORIUS_MESHES = 5,
  RISORIUS_LODS = 6 /* levels of detail; they have no names */
};
typedef uint32_t risorius_list;

/* What risorius_options can ask for. */
enum {
  RISORIUS_GEOMETRY = 1,         /* read the meshes; else they have a name and nothing else */
  RISORIUS_TARGETS = 2,          /* and the shapes of the meshes; goes with RISORIUS_GEOMETRY */
  RISORIUS_WITHOUT_NETWORKS = 4, /* do not read neural networks */
  RISORIUS_WITHOUT_SOLVERS = 8,  /* do not read solvers of radial basis functions */
  RISORIUS_QUATERNIONS = 16,     /* rotations as quaternions and not as Euler angles */
  RISORIUS_FLOAT16 = 32          /* keep the joint matrices in half the memory, 11 bits exact */
};

/* What to read. All zero, like NULL in place of the struct: every LOD, no geometry. */
typedef struct risorius_options {
  uint32_t flags;            /* RISORIUS_GEOMETRY and those after it */
  uint32_t lod_count;        /* 0: all */
  const uint16_t* lods;      /* uint16[lod_count], each once and in the file; what no kept LOD
                                uses is gone, and every index
                                counts in what is left */
  uint32_t mesh_count;       /* 0: all; else asks for RISORIUS_GEOMETRY */
  const char* const* meshes; /* names of the meshes whose geometry is kept, UTF-8 */
} risorius_options;

/* The joints at rest, and in what the file counts. Without behavior in the file joints have no
 * values, and stride is 9 as ever. */
typedef struct risorius_skeleton {
  uint32_t joint_count;
  uint32_t stride;           /* numbers of a joint: 9, or 10 with RISORIUS_QUATERNIONS */
  const uint16_t* parents;   /* uint16[joints]; a root is its own parent */
  const float* neutral;      /* float[joints, stride]: tx ty tz, rx ry rz or qx qy qz qw, sx sy sz,
                                relative to the parent */
  uint32_t translation_unit; /* 0 centimetres, 1 metres */
  uint32_t rotation_unit;    /* of Euler angles: 0 degrees, 1 radians */
  uint32_t axes[3];          /* where x, y, z point: 0 left 1 right 2 up 3 down 4 front 5 back */
  uint32_t rotation_order;   /* 0 xyz 1 xzy 2 yxz 3 yzx 4 zxy 5 zyx; the first axis turns first */
  int32_t rotation_signs[3]; /* 1 or -1 */
} risorius_skeleton;

/* A mesh at rest. A corner of a polygon has a position, a texture coordinate and a normal by index.
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
  const uint32_t* skin_begins;      /* uint32[vertices + 1] into the two below; NULL: no skin */
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

/* RISORIUS_ABI of the library that runs: unequal to the header's, it is another library. */
RISORIUS_API uint32_t risorius_abi(void);

/* Its version, e.g. "0.1.0". */
RISORIUS_API const char* risorius_version(void);

/* Of the last call of this thread that failed; never NULL. */
RISORIUS_API const risorius_error* risorius_last_error(void);

/* ---- faces ---- */

/* Reads and compiles a DNA file.
 * In:    path     UTF-8
 *        options  NULL: every LOD, no geometry
 * Out:   face     to be closed with risorius_close
 * Fails: RISORIUS_NOT_READABLE, RISORIUS_BAD_FILE, RISORIUS_TOO_LARGE, RISORIUS_BAD_ARGUMENT (an
 *        option, a LOD or a mesh that is not there) */
RISORIUS_API risorius_status risorius_open_file(const char* path, const risorius_options* options,
                                                risorius_face** face);

/* The same from the bytes of a file, which are not needed afterwards. */
RISORIUS_API risorius_status risorius_open_memory(const void* bytes, size_t size,
                                                  const risorius_options* options,
                                                  risorius_face** face);

/* NULL is no face, and nothing happens. */
RISORIUS_API void risorius_close(risorius_face* face);

/* How many there are. 0 and an error for a list that is none. */
RISORIUS_API uint32_t risorius_count(const risorius_face* face, risorius_list list);

/* The name of one, UTF-8 as the file has it. NULL and an error: there is none. */
RISORIUS_API const char* risorius_name(const risorius_face* face, risorius_list list,
                                       uint32_t index);

/* Which joints, shapes, maps or meshes belong to a LOD.
 * Out: items  uint16[count], indices of the list; count */
RISORIUS_API risorius_status risorius_lod_items(const risorius_face* face, risorius_list list,
                                                uint32_t lod, const uint16_t** items,
                                                uint32_t* count);

RISORIUS_API risorius_status risorius_get_skeleton(const risorius_face* face,
                                                   risorius_skeleton* skeleton);

/* A mesh that was not read, or was filtered out, has counts of 0. */
RISORIUS_API risorius_status risorius_get_mesh(const risorius_face* face, uint32_t mesh,
                                               risorius_mesh* out);

/* In: target  below the mesh's target_count */
RISORIUS_API risorius_status risorius_get_target(const risorius_face* face, uint32_t mesh,
                                                 uint32_t target, risorius_target* out);

/* ---- instances ---- */

/* How an instance goes through time. RISORIUS_SETTLED: a pose is a function of the controls alone.
 * RISORIUS_LATENT: networks, solvers and correctives read what comes after them as the evaluation
 * before left it, as in the reference implementation. */
enum { RISORIUS_SETTLED = 0, RISORIUS_LATENT = 1 };
typedef uint32_t risorius_timing;

/* A face at rest, at LOD 0.
 * Out: instance  to be ended with risorius_destroy */
RISORIUS_API risorius_status risorius_create(const risorius_face* face, risorius_timing timing,
                                             risorius_instance** instance);

/* NULL is no instance, and nothing happens. */
RISORIUS_API void risorius_destroy(risorius_instance* instance);

/* Sets controls `first` to `first + count - 1` of RISORIUS_RAW_CONTROLS or RISORIUS_GUI_CONTROLS.
 * GUI controls change the raw controls that their table writes, at once: whichever was set last
 * counts.
 * In:    values  float[count], finite. Raw controls are not clamped: beyond 1 joints follow on.
 * Fails: RISORIUS_BAD_ARGUMENT, and nothing was set */
RISORIUS_API risorius_status risorius_set(risorius_instance* instance, risorius_list list,
                                          uint32_t first, uint32_t count, const float* values);

/* Another level of detail for the evaluations to come. */
RISORIUS_API risorius_status risorius_set_lod(risorius_instance* instance, uint32_t lod);

/* The pose of the controls. */
RISORIUS_API risorius_status risorius_evaluate(risorius_instance* instance);

/* Values of an instance: its controls as they were set, the others as of the last evaluation.
 * Joints are what is added to neutral, float[joints, stride] (with quaternions their product with
 * neutral); a scale of 0 is no scale. What the LOD does not use is 0.
 * In:  list   RISORIUS_RAW_CONTROLS to RISORIUS_MAPS
 * Out: count  how many floats; may be NULL
 * Returns NULL and an error: no such list. Where there are no numbers it is no error, and the
 * pointer must not be read. */
RISORIUS_API const float* risorius_values(const risorius_instance* instance, risorius_list list,
                                          uint32_t* count);

#ifdef __cplusplus
}
#endif

#endif
