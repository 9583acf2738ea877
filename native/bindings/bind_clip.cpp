// SPDX-License-Identifier: MIT
// Binds .rzc clip files: encoding, reading in parts, and recording.
#include <mutex>
#include <numeric>

#include "bindings/numpy_arrays.h"
#include "bytes/file_write.h"
#include "bytes/path_text.h"
#include "clip/file/encoder.h"
#include "clip/file/file_writer.h"
#include "clip/file/reader.h"

namespace risorius::bindings {

namespace {

using DoubleArray = py::array_t<double, py::array::c_style | py::array::forcecast>;
using PlainEvent = std::tuple<double, py::object, double, py::object>;
using Pairs = std::vector<std::pair<py::object, py::object>>;

PyObject* clip_error_type = nullptr;

template <class T>
T taken(core::Result<T>&& result, const std::string& file = "") {
  if (!result) throw_error(result.error(), file, clip_error_type);
  return std::move(result).value();
}

clip::Head head_from_python(const std::vector<py::object>& names, double rate, double start,
                            bool has_times, const Pairs& metadata) {
  clip::Head head;
  for (const py::object& name : names) head.names.push_back(text_from_python(name, "names"));
  head.rate = rate;
  head.start = start;
  head.has_times = has_times;
  for (const auto& [key, value] : metadata) {
    head.metadata.emplace_back(text_from_python(key, "metadata"),
                               text_from_python(value, "metadata"));
  }
  return head;
}

clip::Event event_from_python(const PlainEvent& event) {
  return {std::get<0>(event), text_from_python(std::get<1>(event), "event.name"),
          std::get<2>(event), text_from_python(std::get<3>(event), "event.value")};
}

std::vector<double> times_from_python(const std::optional<DoubleArray>& times) {
  if (!times) return {};
  return {times->data(), times->data() + times->size()};
}

py::bytes encode_clip(const std::vector<py::object>& names, const FloatArray& curves, double rate,
                      double start, const std::optional<DoubleArray>& times,
                      const std::vector<PlainEvent>& events, const Pairs& metadata,
                      std::size_t block_frames) {
  if (curves.ndim() != 2) shape_error("curves", "(controls, frames)", curves);
  clip::Clip clip;
  clip.head = head_from_python(names, rate, start, times.has_value(), metadata);
  clip.frame_count = static_cast<std::size_t>(curves.shape(1));
  clip.curves.assign(curves.data(), curves.data() + curves.size());
  clip.times = times_from_python(times);
  for (const PlainEvent& event : events) clip.events.push_back(event_from_python(event));
  auto bytes = [&] {
    const py::gil_scoped_release release;
    return clip::encode(clip, block_frames);
  }();
  const clip::Bytes out = taken(std::move(bytes));
  return {reinterpret_cast<const char*>(out.data()), out.size()};
}

void write_clip(const std::filesystem::path& path, const py::bytes& bytes) {
  const auto view = static_cast<std::string_view>(bytes);
  auto written = [&] {
    const py::gil_scoped_release release;
    return bytes::write_file_atomically(
        path, {reinterpret_cast<const std::uint8_t*>(view.data()), view.size()});
  }();
  taken(std::move(written));
}

// A clip file for Python. A mutex lets only one thread read at a time, because a Reader caches one
// decoded block.
class ClipFile {
 public:
  ClipFile(const py::object& source, bool recover) {
    std::unique_ptr<bytes::Source> from;
    if (py::isinstance<py::bytes>(source)) {
      bytes_ = source;
      const auto view = static_cast<std::string_view>(bytes_);
      from = std::make_unique<bytes::SpanSource>(
          clip::View(reinterpret_cast<const std::uint8_t*>(view.data()), view.size()));
    } else {
      const auto path = source.cast<std::filesystem::path>();
      name_ = bytes::utf8(path);
      from = taken(bytes::open_file(path));
    }
    auto opened = [&] {
      const py::gil_scoped_release release;
      return clip::Reader::open(std::move(from),
                                recover ? clip::Ends::kMayBeCut : clip::Ends::kMustBeWhole);
    }();
    reader_ = std::make_unique<clip::Reader>(taken(std::move(opened), name_));
  }

  const clip::Reader& reader() const { return *reader_; }

  py::tuple read(std::uint64_t begin, std::uint64_t end,
                 const std::optional<std::vector<std::uint32_t>>& wanted) {
    std::vector<std::uint32_t> controls;
    if (wanted) {
      controls = *wanted;
    } else {
      controls.resize(reader_->head().names.size());
      std::iota(controls.begin(), controls.end(), 0u);
    }
    taken(reader_->may_read(begin, end, controls), name_);
    const auto frames = static_cast<py::ssize_t>(end - begin);
    FloatArray curves({static_cast<py::ssize_t>(controls.size()), frames});
    DoubleArray times(reader_->head().has_times ? frames : 0);
    float* const out = curves.mutable_data();
    double* const out_times = times.mutable_data();
    auto done = [&] {
      const py::gil_scoped_release release;
      const std::lock_guard lock(mutex_);
      return reader_->read(begin, end, controls, out, out_times);
    }();
    taken(std::move(done), name_);
    py::object own = py::none();
    if (reader_->head().has_times) own = std::move(times);
    return py::make_tuple(curves, own);
  }

 private:
  py::bytes bytes_;
  std::string name_;
  std::unique_ptr<clip::Reader> reader_;
  std::mutex mutex_;
};

// A writer of a clip file for Python. A mutex lets only one thread use it at a time.
class ClipFileWriter {
  template <class What>
  auto locked(What&& what) {
    const py::gil_scoped_release release;
    const std::lock_guard lock(mutex_);
    return what();
  }

 public:
  ClipFileWriter(const std::filesystem::path& path, const std::vector<py::object>& names,
                 double rate, double start, bool has_times, const Pairs& metadata,
                 std::size_t block_frames)
      : writer_(taken(clip::FileWriter::create(
            path, head_from_python(names, rate, start, has_times, metadata), block_frames))) {}

  void append(const FloatArray& frames, const std::optional<DoubleArray>& times) {
    if (frames.ndim() != 2 ||
        frames.shape(1) != static_cast<py::ssize_t>(writer_.head().names.size())) {
      shape_error("frames", "(n, " + std::to_string(writer_.head().names.size()) + ")", frames);
    }
    const std::vector<double> own = times_from_python(times);
    const std::span<const float> values(frames.data(), static_cast<std::size_t>(frames.size()));
    taken(locked([&] { return writer_.append(values, own); }));
  }
  void event(const PlainEvent& event) {
    locked([&, value = event_from_python(event)]() mutable { writer_.add(std::move(value)); });
  }
  void close() {
    taken(locked([&] { return writer_.close(); }));
  }
  const clip::FileWriter& writer() const { return writer_; }

 private:
  clip::FileWriter writer_;
  std::mutex mutex_;
};

py::tuple names_of(const clip::Head& head) {
  py::tuple names(head.names.size());
  for (std::size_t i = 0; i < head.names.size(); ++i) names[i] = to_python(head.names[i]);
  return names;
}

py::dict metadata_of(const clip::Head& head) {
  py::dict out;
  for (const auto& [key, value] : head.metadata) out[to_python(key)] = to_python(value);
  return out;
}

py::list events_of(const clip::Reader& reader) {
  py::list out;
  for (const clip::Event& event : reader.events()) {
    out.append(
        py::make_tuple(event.time, to_python(event.name), event.duration, to_python(event.value)));
  }
  return out;
}

void bind_reader(py::module_& m) {
  py::class_<ClipFile>(m, "ClipFile", "A .rzc file that is read in parts.")
      .def(py::init<const py::object&, bool>(), py::arg("source"), py::arg("recover") = false)
      .def_property_readonly("names", [](const ClipFile& f) { return names_of(f.reader().head()); })
      .def_property_readonly("rate", [](const ClipFile& f) { return f.reader().head().rate; })
      .def_property_readonly("start", [](const ClipFile& f) { return f.reader().head().start; })
      .def_property_readonly("has_times",
                             [](const ClipFile& f) { return f.reader().head().has_times; })
      .def_property_readonly("frame_count",
                             [](const ClipFile& f) { return f.reader().frame_count(); })
      .def_property_readonly("byte_count",
                             [](const ClipFile& f) { return f.reader().byte_count(); })
      .def_property_readonly("block_starts",
                             [](const ClipFile& f) { return f.reader().block_starts(); })
      .def_property_readonly("metadata",
                             [](const ClipFile& f) { return metadata_of(f.reader().head()); })
      .def_property_readonly("events", [](const ClipFile& f) { return events_of(f.reader()); })
      .def("read", &ClipFile::read, py::arg("begin"), py::arg("end"),
           py::arg("controls") = py::none());
}

}  // namespace

void bind_clip(py::module_& m) {
  // Kept for the life of the process, like the interpreter's own exception types.
  clip_error_type = new_error_type(
      "risorius.ClipError",
      "A clip that cannot be read or written.\n\n"
      "code: str, e.g. 'truncated'. offset: byte offset in the file or None. where: the part of "
      "the clip, e.g. 'blocks[3].times'.");
  m.attr("ClipError") = py::handle(clip_error_type);
  m.def("encode_clip", &encode_clip, py::arg("names"), py::arg("curves"), py::arg("rate"),
        py::arg("start"), py::arg("times"), py::arg("events"), py::arg("metadata"),
        py::arg("block_frames") = clip::kDefaultBlockFrames);
  m.def("write_clip", &write_clip, py::arg("path"), py::arg("bytes"));
  bind_reader(m);
  py::class_<ClipFileWriter>(m, "ClipFileWriter", "Records a .rzc file.")
      .def(py::init<const std::filesystem::path&, const std::vector<py::object>&, double, double,
                    bool, const Pairs&, std::size_t>(),
           py::arg("path"), py::arg("names"), py::arg("rate"), py::arg("start"),
           py::arg("has_times"), py::arg("metadata"),
           py::arg("block_frames") = clip::kDefaultBlockFrames)
      .def_property_readonly("frame_count",
                             [](const ClipFileWriter& w) { return w.writer().frame_count(); })
      .def_property_readonly("is_open",
                             [](const ClipFileWriter& w) { return w.writer().is_open(); })
      .def_property_readonly("part", [](const ClipFileWriter& w) { return w.writer().part(); })
      .def("append", &ClipFileWriter::append, py::arg("frames"), py::arg("times") = py::none())
      .def("event", &ClipFileWriter::event, py::arg("event"))
      .def("close", &ClipFileWriter::close);
}

}  // namespace risorius::bindings
