// SPDX-License-Identifier: MIT
// Functions that the web page needs in addition to risorius.h: deforming a mesh with its normals,
// and reading .rzc files. Called from one thread; the page owns the arrays, which are in the memory
// of this WebAssembly module.
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "clip/file/reader.h"

#define PAGE_API extern "C" __attribute__((visibility("default")))

namespace {

using Four = float __attribute__((vector_size(16), aligned(16)));

// A mesh of the page. skin.js writes this struct, 19 words of 32 bits, into memory.
struct PageMesh {
  std::uint32_t positions, vertices, triangles, targets;
  const Four* rest;               // [positions]
  const std::uint32_t* source;    // [vertices]: index of the position of each vertex
  const std::uint32_t* corners;   // [3 * triangles]: indices of positions
  const std::uint32_t* begins;    // [positions + 1]: first influence of each position
  const std::uint32_t* joints;    // [influences]
  const float* weights;           // [influences]
  const std::uint32_t* moved;     // [targets + 1]: first entry of a target in moves and deltas
  const std::uint32_t* channels;  // [targets]: blend shape channel
  const std::uint32_t* moves;     // [entries]: index of the position that moves
  const Four* deltas;             // [entries]: displacement of that position
  const Four* normals;            // [positions] undeformed; null: computed from the triangles
  Four* shaped;                   // [positions] after the blend shapes
  Four* placed;                   // [positions] after blend shapes and joints
  Four* turned;                   // [positions] normals
  float* out;                     // [vertices, 6]: position, then normal
};

Four cross(Four a, Four b) {
  const Four ayzx = __builtin_shufflevector(a, a, 1, 2, 0, 3);
  const Four byzx = __builtin_shufflevector(b, b, 1, 2, 0, 3);
  const Four c = a * byzx - ayzx * b;
  return __builtin_shufflevector(c, c, 1, 2, 0, 3);
}

void add_shapes(const PageMesh& mesh, const float* channels) {
  for (std::uint32_t v = 0; v < mesh.positions; ++v) mesh.shaped[v] = mesh.rest[v];
  for (std::uint32_t t = 0; t < mesh.targets; ++t) {
    const float weight = channels[mesh.channels[t]];
    if (weight == 0.0f) continue;
    for (std::uint32_t i = mesh.moved[t]; i < mesh.moved[t + 1]; ++i) {
      mesh.shaped[mesh.moves[i]] += weight * mesh.deltas[i];
    }
  }
}

// Deforms positions, and normals unless mesh.normals is null, by the joints. In: matrices  the four
// columns of each joint's skinning matrix
void add_joints(const PageMesh& mesh, const Four* matrices) {
  for (std::uint32_t v = 0; v < mesh.positions; ++v) {
    Four x{}, y{}, z{}, w{};
    for (std::uint32_t i = mesh.begins[v]; i < mesh.begins[v + 1]; ++i) {
      const Four* const joint = matrices + 4 * mesh.joints[i];
      const float weight = mesh.weights[i];
      x += weight * joint[0];
      y += weight * joint[1];
      z += weight * joint[2];
      w += weight * joint[3];
    }
    const Four p = mesh.shaped[v];
    mesh.placed[v] = x * p[0] + y * p[1] + z * p[2] + w;
    if (mesh.normals == nullptr) continue;
    const Four n = mesh.normals[v];
    mesh.turned[v] = x * n[0] + y * n[1] + z * n[2];
  }
}

// Computes normals of vertices as the sum of the triangles' normals, weighted by area.
void find_normals(const PageMesh& mesh) {
  for (std::uint32_t v = 0; v < mesh.positions; ++v) mesh.turned[v] = Four{};
  for (std::uint32_t i = 0; i < 3 * mesh.triangles; i += 3) {
    const std::uint32_t a = mesh.corners[i], b = mesh.corners[i + 1], c = mesh.corners[i + 2];
    const Four own = mesh.placed[a];
    const Four normal = cross(mesh.placed[b] - own, mesh.placed[c] - own);
    mesh.turned[a] += normal;
    mesh.turned[b] += normal;
    mesh.turned[c] += normal;
  }
}

void write_out(const PageMesh& mesh) {
  for (std::uint32_t v = 0; v < mesh.positions; ++v) {
    const Four n = mesh.turned[v];
    const float length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    mesh.turned[v] = length > 0.0f ? n / length : n;
  }
  float* out = mesh.out;
  for (std::uint32_t v = 0; v < mesh.vertices; ++v, out += 6) {
    const Four p = mesh.placed[mesh.source[v]], n = mesh.turned[mesh.source[v]];
    out[0] = p[0], out[1] = p[1], out[2] = p[2];
    out[3] = n[0], out[4] = n[1], out[5] = n[2];
  }
}

struct PageClip {
  double rate, start;
  std::uint32_t controls, frames;
  const char* names;    // each ends with 0
  const float* curves;  // [controls, frames]
  const double* times;  // [frames], or null
  const char* error;    // null: the clip was read
};

}  // namespace

PAGE_API void page_pose(const PageMesh* mesh, const float* matrices, const float* channels) {
  add_shapes(*mesh, channels);
  add_joints(*mesh, reinterpret_cast<const Four*>(matrices));
  if (mesh->normals == nullptr) find_normals(*mesh);
  write_out(*mesh);
}

/// Reads a whole .rzc file. The result is valid until the next call.
PAGE_API const PageClip* page_clip(const std::uint8_t* bytes, std::uint32_t size) {
  static risorius::clip::Clip clip;
  static std::string names;  // or the error text
  static PageClip page;
  page = {};
  auto read = risorius::clip::decode({bytes, size});
  if (!read) {
    names = read.error().describe();
    page.error = names.c_str();
    return &page;
  }
  clip = std::move(*read);
  names.clear();
  for (const std::string& name : clip.head.names) names.append(name).push_back('\0');
  page.rate = clip.head.rate;
  page.start = clip.head.start;
  page.controls = static_cast<std::uint32_t>(clip.head.names.size());
  page.frames = static_cast<std::uint32_t>(clip.frame_count);
  page.names = names.c_str();
  page.curves = clip.curves.data();
  page.times = clip.times.empty() ? nullptr : clip.times.data();
  return &page;
}
