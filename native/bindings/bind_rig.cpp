// SPDX-License-Identifier: MIT
// Binds Rig, a compiled face, and its evaluation from raw controls to poses.
#include <algorithm>
#include <list>

#include "bindings/direct/pose_arrays.h"
#include "bindings/numpy_arrays.h"
#include "compile/compile.h"
#include "core/parallel_for.h"
#include "dna/validate.h"
#include "rig/block.h"
#include "rig/finite_controls.h"
#include "rig/rig_file.h"
#include "rig/stages/evaluate.h"
#include "rig/stages/instance.h"
#include "rig/stages/rbf.h"
#include "rig/stages/tables.h"

namespace risorius::bindings {

namespace {

using RigPtr = std::shared_ptr<const rig::Rig>;

struct PyInstance {
  RigPtr rig;
  rig::Instance instance;
};

py::list quaternion_column_orders(const dna::Dna& dna) {
  std::vector<dna::Warning> warnings;
  unwrap(dna::validate(dna, warnings));
  const std::vector<bool> joints = compile::quaternion_joints(dna);
  py::list out;
  for (const dna::JointGroup& g : dna.behavior.joint_groups) {
    const auto order = compile::quaternion_column_order(g, dna.descriptor.lod_count, joints);
    out.append(py::array_t<std::uint32_t>(static_cast<py::ssize_t>(order.size()), order.data()));
  }
  return out;
}

py::array_t<float> copied(std::span<const float> values, std::vector<py::ssize_t> shape) {
  py::array_t<float> out(std::move(shape));
  std::copy(values.begin(), values.end(), out.mutable_data());
  return out;
}

py::ssize_t stride_of(const rig::Rig& rig) { return static_cast<py::ssize_t>(rig.joint_stride); }

py::ssize_t length(std::uint32_t n) { return static_cast<py::ssize_t>(n); }

PoseArrays to_arrays(const rig::Rig& rig, const rig::Pose& pose) {
  const auto size = [](const std::vector<float>& v) { return static_cast<py::ssize_t>(v.size()); };
  return {copied(pose.joints, {static_cast<py::ssize_t>(rig.joint_count), stride_of(rig)}),
          copied(pose.blend_shapes, {size(pose.blend_shapes)}),
          copied(pose.animated_maps, {size(pose.animated_maps)}),
          copied(pose.controls, {size(pose.controls)})};
}

// True for the second of two names, False for the first; raises ValueError for any other name.
bool is_second(const char* name, const std::string& given, const char* first, const char* second) {
  if (given == second) return true;
  if (given == first) return false;
  throw py::value_error(std::string(name) + ": " + first + " or " + second +
                        " was expected, found " + given);
}

const simd::Kernels& kernels_argument(const std::optional<std::string>& simd) {
  const simd::Kernels* kernels = simd::find_kernels(simd ? simd->c_str() : nullptr);
  if (kernels != nullptr) return *kernels;
  throw py::value_error("simd: " + simd.value_or("RISORIUS_SIMD") +
                        " is not available here; there are: " + simd::available_kernels());
}

std::shared_ptr<rig::Rig> make_rig(const dna::Dna& dna, const std::string& precision,
                                   const std::string& rotation,
                                   const std::optional<std::string>& simd) {
  compile::CompileOptions options;
  if (is_second("precision", precision, "float32", "float16")) {
    options.precision = compile::Precision::kFloat16;
  }
  if (is_second("rotation", rotation, "euler", "quaternion")) {
    options.rotation = compile::Rotation::kQuaternion;
  }
  if (simd) options.kernels = &kernels_argument(simd);
  return std::make_shared<rig::Rig>(unwrap(compile::compile(dna, options)));
}

// An owner for open_rig that keeps a Python buffer alive. The last copy of the owner may be
// released by a thread that does not hold the interpreter lock.
std::shared_ptr<const void> keep(const py::buffer& buffer, const void* address) {
  auto* held = new py::buffer_info(buffer.request());
  return {address, [held](const void*) {
            const py::gil_scoped_acquire acquired;
            delete held;
          }};
}

// Opens a rig from its bytes. A bytes object is immutable, so it is used in place, unless its
// address is not a multiple of 64. Any other buffer is copied, even a read-only view, because the
// view's owner may still write to it.
std::shared_ptr<rig::Rig> rig_from_bytes(const py::buffer& buffer, bool trusted,
                                         const std::optional<std::string>& simd) {
  const py::buffer_info info = buffer.request();
  if (!PyBuffer_IsContiguous(info.view(), 'C')) {
    throw py::value_error("bytes: a contiguous buffer was expected");
  }
  const auto size = static_cast<std::size_t>(info.size * info.itemsize);
  const auto* data = static_cast<const std::uint8_t*>(info.ptr);
  std::shared_ptr<const void> owner;
  const bool is_constant = PyBytes_CheckExact(buffer.ptr()) != 0;
  if (is_constant && reinterpret_cast<std::uintptr_t>(data) % 64 == 0) {
    owner = keep(buffer, data);
  } else {
    auto copy = std::make_shared<core::AlignedVector<std::uint8_t>>(data, data + size);
    data = copy->data();
    owner = std::move(copy);
  }
  const rig::BlockCheck check = trusted ? rig::BlockCheck::kHeader : rig::BlockCheck::kFull;
  return std::make_shared<rig::Rig>(
      unwrap(rig::open_rig({data, size}, std::move(owner), check, kernels_argument(simd))));
}

// The bytes of a rig. The memoryview keeps its Rig alive.
py::memoryview block_of(const py::object& self) {
  const auto& block = self.cast<const rig::Rig&>().block();
  py::array_t<std::uint8_t> view({static_cast<py::ssize_t>(block.size())}, {py::ssize_t{1}},
                                 block.data(), self);
  view.attr("flags").attr("writeable") = false;
  return py::memoryview(view);
}

void save_rig(const rig::Rig& rig, const std::filesystem::path& path) {
  const auto write = [&] {
    const py::gil_scoped_release released;
    return rig::save_rig(rig, path);
  };
  unwrap(write());
}

std::shared_ptr<rig::Rig> load_rig(const std::filesystem::path& path, std::optional<bool> trusted,
                                   const std::optional<std::string>& simd, bool mapped) {
  const simd::Kernels& kernels = kernels_argument(simd);
  rig::Trust trust = rig::Trust::kOwner;
  if (trusted) trust = *trusted ? rig::Trust::kCaller : rig::Trust::kNobody;
  const auto open = [&] {
    const py::gil_scoped_release released;
    return rig::open_rig_file(path, trust, mapped ? bytes::ReadBy::kMap : bytes::ReadBy::kCopy,
                              kernels);
  };
  return std::make_shared<rig::Rig>(unwrap(open()));
}

// Converts the raw controls of one frame, float32[R], or of several frames, float32[N, R]. Raises
// ValueError for another shape.
FloatArray frames_argument(const rig::Rig& rig, const py::object& raw) {
  FloatArray in = FloatArray::ensure(raw);
  if (!in) throw py::value_error("raw: an array of numbers was expected");
  const py::ssize_t n = in.ndim();
  if ((n != 1 && n != 2) || static_cast<std::size_t>(in.shape(n - 1)) != rig.raw_count) {
    const std::string count = std::to_string(rig.raw_count);
    shape_error("raw", "(" + count + ",) or (n, " + count + ")", in);
  }
  return in;
}

// Returns (frame, name of the control, value) for each raw control that is not finite.
py::list find_non_finite(const rig::Rig& rig, const py::object& raw) {
  const FloatArray in = frames_argument(rig, raw);
  const auto frames = static_cast<std::size_t>(in.ndim() == 1 ? 1 : in.shape(0));
  const std::vector<std::string> names = rig.raw_control_names();
  py::list out;
  for (const rig::NonFinite& f : rig::find_non_finite(rig, in.data(), frames)) {
    out.append(py::make_tuple(f.frame, to_python(names[f.control]), f.value));
  }
  return out;
}

// Returns the distances of the controls from the poses of the solver `index`, float64[poses], and
// the weights of these poses, float32[poses].
py::tuple solver_poses(const rig::Rig& rig, std::uint32_t index, const py::object& controls) {
  if (index >= rig.rbf_solvers.size()) {
    throw py::index_error("index: a solver below " + std::to_string(rig.rbf_solvers.size()) +
                          " was expected, found " + std::to_string(index));
  }
  const FloatArray in = vector_argument(controls, "controls", rig.control_count);
  const auto poses = static_cast<py::ssize_t>(rig.rbf_solvers[index].pose_count);
  py::array_t<double> distances(poses);
  py::array_t<float> weights(poses);
  rig::Workspace work = rig::make_workspace(rig);
  rig::solver_poses(rig, index, in.data(), work, distances.mutable_data(), weights.mutable_data());
  return py::make_tuple(distances, weights);
}

// The workspace of a Rig. Each thread keeps the workspaces of the last 8 Rigs that it evaluated,
// because making a workspace takes longer than an evaluation.
rig::Workspace& workspace_of(const rig::Rig& rig) {
  struct Kept {
    std::uint64_t rig;
    rig::Workspace work;
  };
  constexpr std::size_t kMost = 8;
  thread_local std::list<Kept> last;  // most recently used first
  auto found = std::ranges::find(last, rig.number, &Kept::rig);
  if (found != last.end()) {
    last.splice(last.begin(), last, found);
  } else {
    last.push_front({rig.number, rig::make_workspace(rig)});
    if (last.size() > kMost) last.pop_back();
  }
  return last.front().work;
}

PoseArrays evaluate(const rig::Rig& rig, const py::object& raw, std::uint32_t lod, bool settle,
                    bool check) {
  const FloatArray in = vector_argument(raw, "raw", rig.raw_count);
  if (check) unwrap(rig::check_finite(rig, in.data(), 1));
  PoseArrays out = new_pose(rig);
  const rig::PoseView pose = view_of(out);
  if (settle) {
    rig::evaluate(rig, in.data(), lod, true, workspace_of(rig), pose);
  } else {  // a new workspace, so that no value of an earlier frame takes part
    rig::Workspace work = rig::make_workspace(rig);
    rig::evaluate(rig, in.data(), lod, false, work, pose);
  }
  return out;
}

PoseArrays evaluate_batch(const rig::Rig& rig, const py::object& raw, std::uint32_t lod,
                          std::size_t threads, bool settle, bool check) {
  const FloatArray in = FloatArray::ensure(raw);
  if (!in || in.ndim() != 2 || static_cast<std::size_t>(in.shape(1)) != rig.raw_count) {
    if (!in) throw py::value_error("raw: an array of numbers was expected");
    shape_error("raw", "(n, " + std::to_string(rig.raw_count) + ")", in);
  }
  const auto n = in.shape(0);
  if (check) unwrap(rig::check_finite(rig, in.data(), static_cast<std::size_t>(n)));
  PoseArrays out{FloatArray({n, length(rig.joint_count), stride_of(rig)}),
                 FloatArray({n, length(rig.blend_shape_count)}),
                 FloatArray({n, length(rig.animated_map_count)}),
                 FloatArray({n, length(rig.control_count)})};
  const rig::PoseView all = view_of(out);
  const float* rows = in.data();
  py::gil_scoped_release released;
  core::parallel_for(static_cast<std::size_t>(n), threads, [&](std::size_t begin, std::size_t end) {
    rig::Workspace work = rig::make_batch_workspace(rig);
    const rig::PoseView part{all.joints + begin * rig.joint_count * rig.joint_stride,
                             all.blend_shapes + begin * rig.blend_shape_count,
                             all.animated_maps + begin * rig.animated_map_count,
                             all.controls + begin * rig.control_count};
    rig::evaluate_frames(rig, rows + begin * rig.raw_count, end - begin, lod, settle, work, part);
  });
  return out;
}

using RigClass = py::class_<rig::Rig, std::shared_ptr<rig::Rig>>;

py::list texts(const auto& list) {
  py::list out;
  for (const auto& text : list) out.append(to_python(text));
  return out;
}

// Conversions of a Rig to and from bytes and files.
void bind_rig_bytes(RigClass& c) {
  c.def_static("from_bytes", &rig_from_bytes, py::arg("bytes"), py::arg("trusted") = false,
               py::arg("simd") = py::none(),
               "A Rig from the bytes of to_bytes or block, of this version and byte order. A bytes "
               "object whose data is aligned to 64 is used in place and kept; any other buffer is "
               "copied. trusted skips the hash and the check of every index.")
      .def(
          "to_bytes",
          [](const rig::Rig& r) {
            return py::bytes(reinterpret_cast<const char*>(r.block().data()), r.block().size());
          },
          "The compiled face as bytes, which can be cached for from_bytes.")
      .def("save", &save_rig, py::arg("path"),
           "Writes to_bytes() to a file, as a cache for load. The old file stays whole until the "
           "new one is.")
      .def_static("load", &load_rig, py::arg("path"), py::arg("trusted") = false,
                  py::arg("simd") = py::none(), py::kw_only(), py::arg("mapped") = false,
                  "A Rig from a file of save, of this version and byte order. Its hash and every "
                  "index are checked. trusted=None skips the check of the indices if this user "
                  "owns the file and nobody else may write to it (never on Windows). Downloaded "
                  "and unpacked files meet that condition too, so use None only for folders that "
                  "only this program fills. The hash finds damage, not forgery. trusted=True skips "
                  "both checks: one changed bit may then crash the process. mapped uses the pages "
                  "of a trusted file in place: the file may be replaced as a whole, but must not "
                  "be written to or cut while the Rig lives. Raises DnaError.")
      .def("block", &block_of, "The same without a copy: a read-only memoryview of uint8.");
}

// The names, counts and joints of a Rig.
void bind_rig_contents(RigClass& c) {
  c.def_property_readonly("raw_control_names",
                          [](const rig::Rig& r) { return texts(r.raw_control_names()); })
      .def_property_readonly("gui_control_names",
                             [](const rig::Rig& r) { return texts(r.gui_control_names()); })
      .def_readonly("joint_count", &rig::Rig::joint_count)
      .def_readonly("blend_shape_count", &rig::Rig::blend_shape_count)
      .def_readonly("animated_map_count", &rig::Rig::animated_map_count)
      .def_readonly("lod_count", &rig::Rig::lod_count)
      .def_readonly("control_count", &rig::Rig::control_count)
      .def_property_readonly("ignored_layers",
                             [](const rig::Rig& r) { return texts(r.ignored_layers()); })
      .def_property_readonly("memory_bytes", &rig::Rig::memory_bytes)
      .def_property_readonly("simd", [](const rig::Rig& r) { return r.kernels->name; })
      .def_property_readonly("neutral_joints",
                             [](const rig::Rig& r) {
                               return copied(
                                   r.neutral_joints,
                                   {static_cast<py::ssize_t>(r.joint_count), stride_of(r)});
                             })
      .def_property_readonly("rotation",
                             [](const rig::Rig& r) {
                               return std::string(r.joint_stride == 10 ? "quaternion" : "euler");
                             })
      .def_property_readonly(
          "initial_raw_controls",
          [](const rig::Rig& r) {
            return copied(r.initial_controls.first(r.raw_count),
                          {static_cast<py::ssize_t>(r.raw_count)});
          },
          "float32[R]: 0, but 1 for the w of each rotation that solvers and setups read.")
      .def_property_readonly("joint_indices_written", [](const rig::Rig& r) {
        return py::array_t<std::uint16_t>(static_cast<py::ssize_t>(r.joints_written.size()),
                                          r.joints_written.data());
      });
}

void bind_rig_evaluation(RigClass& c) {
  c.def(
       "gui_to_raw",
       [](const rig::Rig& r, const py::object& gui) {
         const FloatArray in = vector_argument(gui, "gui", r.gui_count);
         py::array_t<float> raw(static_cast<py::ssize_t>(r.raw_count));
         rig::gui_to_raw(r, in.data(), raw.mutable_data());
         return raw;
       },
       py::arg("gui"), "float32[G] -> float32[R] in [0, 1]")
      .def(
          "raw_to_gui",
          [](const rig::Rig& r, const py::object& raw) {
            const FloatArray in = vector_argument(raw, "raw", r.raw_count);
            py::array_t<float> gui(static_cast<py::ssize_t>(r.gui_count));
            rig::raw_to_gui(r, in.data(), gui.mutable_data());
            return gui;
          },
          py::arg("raw"), "float32[R] -> float32[G], if the table can be inverted")
      .def("evaluate", &evaluate, py::arg("raw"), py::arg("lod") = 0, py::arg("settle") = true,
           py::arg("check") = false,
           "float32[R] -> Pose, which depends on raw alone if settle is true. Outside [0, 1] "
           "joints and blend shapes extrapolate, correctives clamp their factors, and maps rest "
           "outside their intervals. NaN or infinity spoils only the outputs that its control "
           "drives, and no later pose; with check it raises a DnaError that names the control.")
      .def("evaluate_batch", &evaluate_batch, py::arg("raw"), py::arg("lod") = 0,
           py::arg("threads") = 0, py::arg("settle") = true, py::arg("check") = false,
           "float32[N, R] -> Pose whose fields have a leading N. threads 0 uses all cores. With "
           "check a DnaError names the first frame and control that is not finite.")
      .def("find_non_finite", &find_non_finite, py::arg("raw"),
           "float32[R] or float32[N, R] -> [(frame, name, value)] of all values that are NaN or "
           "infinite.")
      .def("solver_poses", &solver_poses, py::arg("index"), py::arg("controls"),
           "Distances and weights of an RBF solver for a Pose's controls: (float64[poses] "
           "distances of its inputs from each pose, in radians if they are angles; float32[poses] "
           "weights, 0 below the threshold).")
      .def("instance",
           [](const std::shared_ptr<rig::Rig>& r) { return PyInstance{r, rig::Instance(*r)}; });
}

void bind_rig_class(py::module_& m) {
  RigClass c(m, "Rig",
             "A compiled face: turns raw controls into a Pose. Immutable, shared freely.");
  c.def(py::init(&make_rig), py::arg("dna"), py::kw_only(), py::arg("precision") = "float32",
        py::arg("rotation") = "euler", py::arg("simd") = py::none());
  bind_rig_bytes(c);
  bind_rig_contents(c);
  bind_rig_evaluation(c);
}

}  // namespace

void bind_rig(py::module_& m) {
  py::class_<PoseArrays>(m, "Pose",
                         "joints float32[J, 9]: tx ty tz rx ry rz sx sy sz deltas from neutral in "
                         "the file's units and axes, or with rotation='quaternion' [J, 10]: tx ty "
                         "tz qx qy qz qw sx sy sz; blend_shapes[B]; animated_maps[A] in [0, 1]; "
                         "controls[raw + corrective + ...]")
      .def_readonly("joints", &PoseArrays::joints)
      .def_readonly("blend_shapes", &PoseArrays::blend_shapes)
      .def_readonly("animated_maps", &PoseArrays::animated_maps)
      .def_readonly("controls", &PoseArrays::controls);
  py::class_<PyInstance>(m, "Instance",
                         "One face through time, with the reference's one-frame latencies.")
      .def_property(
          "lod", [](const PyInstance& s) { return s.instance.lod(); },
          [](PyInstance& s, std::uint32_t lod) { s.instance.set_lod(lod); })
      .def_property(
          "masks",
          [](const PyInstance& s) {
            const auto masks = s.instance.masks();
            return copied(masks, {static_cast<py::ssize_t>(masks.size())});
          },
          [](PyInstance& s, const py::object& masks) {
            const FloatArray in = vector_argument(masks, "masks", s.instance.masks().size());
            for (py::ssize_t i = 0; i < in.size(); ++i) {
              s.instance.set_mask(static_cast<std::size_t>(i), in.data()[i]);
            }
          },
          "float32, one per region of each mesh, mesh after mesh; at 0 the region's networks rest. "
          "This is a copy: assign the whole array.")
      .def(
          "evaluate",
          [](PyInstance& s, const py::object& raw, bool check) {
            const FloatArray in = vector_argument(raw, "raw", s.rig->raw_count);
            if (check) unwrap(rig::check_finite(*s.rig, in.data(), 1));
            return to_arrays(*s.rig, s.instance.evaluate(in.data()));
          },
          py::arg("raw"), py::arg("check") = false,
          "float32[R] -> Pose; with check a value that is not finite raises a DnaError, and the "
          "frame does not count.");
  bind_rig_class(m);
  m.def("rig_block_version", &rig::block_version,
        "Version of Rig.to_bytes; other versions are refused.");
  m.def(
      "compile_version", [] { return compile::kVersion; },
      "Version of the result of compiling a DNA; it is raised when the poses of an existing file "
      "change.");
  m.def("quaternion_column_orders", &quaternion_column_orders, py::arg("dna"),
        "For each joint group, the columns that turn quaternion joints, uint32[n], in the order in "
        "which their rotations are multiplied.");
  m.def(
      "available_simd", [] { return std::string(simd::available_kernels()); },
      "The instruction sets that this processor supports, as simd= accepts them, separated by "
      "blanks.");
}

}  // namespace risorius::bindings
