// SPDX-License-Identifier: MIT
// Faces from controls to finished vertices.
#include <algorithm>
#include <mutex>

#include "bindings/direct/pose_arrays.h"
#include "bindings/numpy_arrays.h"
#include "rig/direct/direct_face.h"

namespace risorius::bindings {

namespace {

/// A face that only one thread evaluates at a time. A thread that waits for `lock` releases the
/// interpreter lock, so that other Python threads go on.
struct PyDirectFace {
  std::unique_ptr<rig::DirectFace> face;
  std::mutex lock;
};
using FacePtr = std::shared_ptr<PyDirectFace>;

rig::FaceParts::Mesh mesh_argument(const py::handle& item) {
  if (!py::isinstance<py::sequence>(item) || py::len(item) != 3) {
    throw py::value_error("meshes: (Morph, base, Skin) was expected for each");
  }
  const auto three = py::reinterpret_borrow<py::sequence>(item);
  if (!py::isinstance<rig::Morph>(three[0]) || !py::isinstance<rig::Skin>(three[2])) {
    throw py::value_error("meshes: (Morph, base, Skin) was expected for each");
  }
  rig::FaceParts::Mesh mesh;
  mesh.morph = three[0].cast<std::shared_ptr<rig::Morph>>();
  mesh.skin = three[2].cast<std::shared_ptr<rig::Skin>>();
  const auto vertices = static_cast<py::ssize_t>(mesh.skin->vertex_count);
  const FloatArray base = shaped_argument(py::object(three[1]), "base", {vertices, 3});
  mesh.base.assign(base.data(), base.data() + base.size());
  return mesh;
}

std::vector<std::uint32_t> indices(const py::object& object, const char* name) {
  const auto values = from_python<std::uint32_t>(object, name);
  return {values.begin(), values.end()};
}

FacePtr make_face(const std::shared_ptr<rig::Rig>& rig,
                  const std::shared_ptr<rig::BoneSpace>& space,
                  const std::shared_ptr<rig::JointChain>& chain, const py::object& rows,
                  const py::sequence& meshes, const py::object& turned) {
  rig::FaceParts parts{rig, space, chain, indices(rows, "rows"), indices(turned, "turned"), {}};
  for (const py::handle item : meshes) parts.meshes.push_back(mesh_argument(item));
  auto face = std::make_shared<PyDirectFace>();
  face->face = unwrap_argument(rig::DirectFace::make(std::move(parts)));
  return face;
}

const rig::FaceParts::Mesh& mesh_of(const PyDirectFace& face, std::size_t mesh) {
  const auto& meshes = face.face->parts().meshes;
  if (mesh < meshes.size()) return meshes[mesh];
  throw py::value_error("mesh " + std::to_string(mesh) + ", but the face has " +
                        std::to_string(meshes.size()));
}

void keep_channels(PyDirectFace& face, const py::object& location, const py::object& rotation,
                   const py::object& scale) {
  const py::ssize_t bones = face.face->parts().chain->size();
  const FloatArray l = shaped_argument(location, "location", {bones, 3}),
                   q = shaped_argument(rotation, "rotation", {bones, 4}),
                   s = shaped_argument(scale, "scale", {bones, 3});
  const py::gil_scoped_release released;
  const std::lock_guard held(face.lock);
  face.face->keep(l.data(), q.data(), s.data());
}

void set_base(PyDirectFace& face, std::uint32_t mesh, const py::object& base) {
  const auto vertices = static_cast<py::ssize_t>(mesh_of(face, mesh).skin->vertex_count);
  const FloatArray points = shaped_argument(base, "base", {vertices, 3});
  const py::gil_scoped_release released;
  const std::lock_guard held(face.lock);
  face.face->set_base(mesh, points.data());
}

void forget_meshes(PyDirectFace& face) {
  const py::gil_scoped_release released;
  const std::lock_guard held(face.lock);
  face.face->forget();
}

// The memory that receives a mesh's vertices.
// In: value     a float32 array [vertices, 3], or a tuple (address, number of vertices)
//     vertices  number of vertices of the mesh
// Out: kept     gets the array, so that its memory stays alive
float* target_argument(const py::handle& value, py::ssize_t vertices,
                       std::vector<py::object>& kept) {
  if (!py::isinstance<py::tuple>(value)) {
    py::array_t<float> out =
        written_argument(py::reinterpret_borrow<py::object>(value), "targets", vertices);
    kept.push_back(out);
    return out.mutable_data();
  }
  const auto pair = py::reinterpret_borrow<py::tuple>(value);
  if (pair.size() != 2) throw py::value_error("targets: (address, vertices) was expected");
  const auto address = pair[0].cast<std::uintptr_t>();
  const auto count = pair[1].cast<py::ssize_t>();
  if (count != vertices) {
    throw py::value_error("targets: memory of " + std::to_string(vertices) +
                          " vertices was expected, found " + std::to_string(count));
  }
  if (address == 0 || address % alignof(float) != 0) {
    throw py::value_error("targets: the address of float32 numbers was expected, found " +
                          std::to_string(address));
  }
  return reinterpret_cast<float*>(address);
}

/// The arguments of one call of evaluate_faces or deform_faces, and the Python objects whose memory
/// must stay alive during the call.
struct Request {
  std::vector<FacePtr> faces;
  std::vector<rig::FaceFrame> frames;
  std::vector<PoseArrays> poses;
  std::vector<py::object> kept;

  Request(const std::vector<FacePtr>& all, const py::sequence& targets, const py::object& turns,
          bool anew)
      : faces(all), frames(all.size()), poses(all.size()) {
    require_length(targets, "targets");
    if (!turns.is_none()) require_length(turns, "turns");
    std::vector<const PyDirectFace*> different;
    for (std::size_t f = 0; f < faces.size(); ++f) {
      if (faces[f] == nullptr) throw py::value_error("faces: a DirectFace was expected for each");
      different.push_back(faces[f].get());
      frames[f].anew = anew;
      add_targets(f, targets[f]);
      if (!turns.is_none()) add_turns(f, py::object(turns[py::int_(f)]));
    }
    std::ranges::sort(different);
    if (std::ranges::adjacent_find(different) != different.end()) {
      throw py::value_error("faces: a face stands there twice");
    }
    require_no_overlap();
  }

  void require_length(const py::object& list, const char* name) const {
    const std::size_t n = py::len(list);
    if (n == faces.size()) return;
    throw py::value_error(std::string(name) + ": one for each of " + std::to_string(faces.size()) +
                          " faces was expected, found " + std::to_string(n));
  }

  const rig::FaceParts& parts(std::size_t f) const { return faces[f]->face->parts(); }

  // Adds the memory that receives the vertices of the meshes of face f.
  // In: object  {index of a mesh: array, or (address, number of vertices)}
  void add_targets(std::size_t f, const py::object& object) {
    if (!py::isinstance<py::dict>(object)) {
      throw py::value_error("targets: {mesh: array or (address, vertices)} was expected for each");
    }
    for (const auto& [key, value] : py::reinterpret_borrow<py::dict>(object)) {
      const auto mesh = key.cast<std::uint32_t>();
      const auto vertices = static_cast<py::ssize_t>(mesh_of(*faces[f], mesh).skin->vertex_count);
      frames[f].targets.push_back({mesh, target_argument(value, vertices, kept)});
    }
  }

  void add_turns(std::size_t f, const py::object& object) {
    if (object.is_none()) return;
    const auto turned = static_cast<py::ssize_t>(parts(f).turned.size());
    const FloatArray values = shaped_argument(object, "turns", {turned, 4});
    kept.push_back(values);
    frames[f].turns = values.data();
  }

  void require_no_overlap() const {
    std::vector<std::pair<const float*, std::size_t>> runs;
    for (std::size_t f = 0; f < faces.size(); ++f) {
      for (const rig::Target& t : frames[f].targets) {
        runs.emplace_back(t.out, std::size_t{parts(f).meshes[t.mesh].skin->vertex_count} * 3);
      }
    }
    std::ranges::sort(runs);
    for (std::size_t i = 1; i < runs.size(); ++i) {
      if (runs[i - 1].first + runs[i - 1].second > runs[i].first) {
        throw py::value_error("targets: two meshes share memory");
      }
    }
  }

  void run(std::size_t threads) {
    std::vector<rig::DirectFace*> all;
    std::vector<std::mutex*> locks;
    for (const FacePtr& face : faces) {
      all.push_back(face->face.get());
      locks.push_back(&face->lock);
    }
    std::ranges::sort(locks);  // sorted, so that two calls cannot deadlock
    const py::gil_scoped_release released;
    std::vector<std::unique_lock<std::mutex>> held;
    for (std::mutex* lock : locks) held.emplace_back(*lock);
    rig::evaluate_faces(all, frames, threads);
  }

  // The indices of the meshes of face f whose vertices the evaluation wrote.
  py::tuple written(std::size_t f) const {
    py::list meshes;
    for (const rig::Target& t : frames[f].targets) {
      if (t.written) meshes.append(t.mesh);
    }
    return py::tuple(meshes);
  }
};

py::list evaluate_faces(const std::vector<FacePtr>& faces, const py::sequence& raw,
                        const std::vector<std::uint32_t>& lods, const py::sequence& targets,
                        const py::object& turns, bool anew, std::size_t threads) {
  Request request(faces, targets, turns, anew);
  request.require_length(raw, "raw");
  request.require_length(py::cast(lods), "lods");
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const rig::Rig& rig = *request.parts(f).rig;
    const FloatArray in = vector_argument(py::object(raw[f]), "raw", rig.raw_count);
    request.kept.push_back(in);
    request.poses[f] = new_pose(rig);
    request.frames[f].raw = in.data();
    request.frames[f].lod = lods[f];
    request.frames[f].pose = view_of(request.poses[f]);
  }
  request.run(threads);
  py::list out;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    out.append(py::make_tuple(request.poses[f], request.written(f)));
  }
  return out;
}

py::list deform_faces(const std::vector<FacePtr>& faces, const py::sequence& joints,
                      const py::sequence& blend_shapes, const py::sequence& targets,
                      const py::object& turns, bool anew, std::size_t threads) {
  Request request(faces, targets, turns, anew);
  request.require_length(joints, "joints");
  request.require_length(blend_shapes, "blend_shapes");
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const rig::Rig& rig = *request.parts(f).rig;
    PoseArrays& pose = request.poses[f];
    pose.joints = shaped_argument(py::object(joints[f]), "joints",
                                  {static_cast<py::ssize_t>(rig.joint_count), py::ssize_t{9}});
    pose.blend_shapes =
        vector_argument(py::object(blend_shapes[f]), "blend_shapes", rig.blend_shape_count);
    // The evaluation only reads these arrays.
    request.frames[f].pose.joints = const_cast<float*>(pose.joints.data());
    request.frames[f].pose.blend_shapes = const_cast<float*>(pose.blend_shapes.data());
  }
  request.run(threads);
  py::list out;
  for (std::size_t f = 0; f < faces.size(); ++f) out.append(request.written(f));
  return out;
}

}  // namespace

void bind_direct(py::module_& m) {
  py::class_<PyDirectFace, FacePtr>(
      m, "DirectFace",
      "A face whose meshes get finished vertices, frame by frame. A mesh is skipped if nothing "
      "changed since it was written to the same memory.")
      .def(py::init(&make_face), py::arg("rig").none(false), py::arg("space").none(false),
           py::arg("chain").none(false), py::arg("rows"), py::arg("meshes"), py::kw_only(),
           py::arg("turned") = py::tuple(),
           "rows int[n]: the index in chain of each bone of space; meshes: (Morph, base float32[V, "
           "3], Skin) each; turned int[t]: the bones of space that get a frame's turns.")
      .def_property_readonly("mesh_count",
                             [](const PyDirectFace& f) { return f.face->parts().meshes.size(); })
      .def("keep", &keep_channels, py::arg("location"), py::arg("rotation"), py::arg("scale"),
           "Sets the transforms of the chain's bones that are not in rows: [B, 3], [B, 4] w x y z, "
           "[B, 3]. They rest before the first call.")
      .def("set_base", &set_base, py::arg("mesh"), py::arg("base"),
           "Replaces the vertices of a mesh before channels and bones, float32[V, 3].")
      .def("forget", &forget_meshes,
           "Makes the next frame write every mesh, for example because its memory changed.");
  m.def(
      "evaluate_faces", &evaluate_faces, py::arg("faces"), py::arg("raw"), py::arg("lods"),
      py::arg("targets"), py::kw_only(), py::arg("turns") = py::none(), py::arg("anew") = false,
      py::arg("threads") = 0,
      "Evaluates one frame of several faces -> [(Pose, written meshes)]. For each face: raw "
      "float32[R]; lod; {mesh: memory for its vertices}, a C-contiguous float32[V, 3] or (address, "
      "V) of such memory, which must stay valid until the call returns; turns float32[t, 4] w x y "
      "z or None, each multiplied from the left to the rotation of its bone. threads 0: as many as "
      "the work is worth, at most all cores; the result does not depend on it.");
  m.def("deform_faces", &deform_faces, py::arg("faces"), py::arg("joints"), py::arg("blend_shapes"),
        py::arg("targets"), py::kw_only(), py::arg("turns") = py::none(), py::arg("anew") = false,
        py::arg("threads") = 0,
        "The same from poses: joints float32[J, 9] and blend_shapes float32[C] of each face -> "
        "[written meshes].");
}

}  // namespace risorius::bindings
