// SPDX-License-Identifier: Apache-2.0
#include "libocc/decode/decode.hpp"

#include "casters.hpp"
#include "fields.hpp"
#include "libocc/core/require.hpp"
#include "module.hpp"
#include "results.hpp"

namespace occ::python {
namespace {

/// What decode() returns: the lamps, and their blobs as the map names them.
struct Decoded {
  std::vector<DecodedLamp> lamps;
  std::vector<Blob> blobs;
};

Result<Decoded> decoded(const std::vector<NumpyImage>& images, const std::vector<double>& times_s,
                        const Sensor& sensor, const std::optional<Scene>& map,
                        const DecodeOptions& options) {
  require(images.size() == times_s.size(), "times_s", times_s.size(),
          "as many as images, " + std::to_string(images.size()));
  std::vector<SequenceFrame> frames;
  for (std::size_t i = 0; i < images.size(); ++i) frames.push_back({images[i].view, times_s[i]});
  py::gil_scoped_release unlocked;
  auto lamps = decode_lamps(frames, sensor, options);
  Result<Decoded> out;
  out.status = lamps.status;
  out.message = lamps.message;
  if (map) {
    auto named = named_blobs(lamps.value, *map, options.code);
    out.value.blobs = std::move(named.value);
    if (out.message.empty()) out.message = named.message;
  } else {
    for (const DecodedLamp& lamp : lamps.value) out.value.blobs.push_back(lamp.blob);
  }
  out.value.lamps = std::move(lamps.value);
  return out;
}

Eigen::MatrixX2d places(const Track& track) {
  std::vector<Eigen::Vector2d> px;
  for (const TrackPoint& point : track.points) px.push_back(point.px);
  return rows_of(px);
}

}  // namespace

void define_decode(py::module_& m) {
  using L = DecodedLamp;
  ResultClass<L>(m, "DecodedLamp", "One light of a sequence and what it says.")
      .def_property_readonly(
          "id", [](const L& l) { return l.code.id; }, "What it says, or None.")
      .def_readonly("code", &L::code, "DecodedCode.")
      .def_readonly("blob", &L::blob,
                    "In the brightest of the frames about `frame`; no rim under a moving camera.")
      .def_readonly("frame", &L::frame, "Index of the frame that `blob` is of.")
      .def_readonly("budget", &L::budget, "CodeBudget of its image.")
      .def_readonly("reference", &L::reference, "s2psk: index of the light that is its reference.")
      .def_property_readonly(
          "track_px", [](const L& l) { return places(l.track); },
          "(n, 2) where it is in each frame, dark or lit [px].")
      .def_property_readonly(
          "seen", [](const L& l) { return l.track.seen; }, "Frames with a blob of it.")
      .def("__repr__", [](const L& l) {
        return std::string("<DecodedLamp: ") +
               (l.code.id ? "id " + std::to_string(*l.code.id) : to_string(l.code.status)) + ">";
      });
  ResultClass<Result<Decoded>> result(m, "Decoded", "The lights of a sequence and what they say.");
  define_result(result);
  result.def_property_readonly("lamps", value_of(&Decoded::lamps), "A DecodedLamp for each light.")
      .def_property_readonly("blobs", value_of(&Decoded::blobs),
                             "Their Blobs, with the lamp_id that the map has for what they say.");
  m.def(
      "decode",
      [](const std::vector<NumpyImage>& images, const std::vector<double>& times_s,
         const Sensor& sensor, const Code& code, const std::optional<Scene>& map, int join_frames,
         bool exact_times) {
        DecodeOptions options;
        options.code = code;
        options.join_frames = join_frames;
        options.samples.exact_times = exact_times;
        return decoded(images, times_s, sensor, map, options);
      },
      py::arg("images"), py::arg("times_s"), py::arg("sensor"), py::arg("code"), py::kw_only(),
      py::arg("map") = py::none(), py::arg("join_frames") = DecodeOptions{}.join_frames,
      py::arg("exact_times") = false,
      R"(Reads the ids that lamps say in the images of a sequence.

images: (height, width) arrays of one size and type. times_s: when each began, rising. sensor: its
row time and exposure say when each line was exposed. code: what the lamps speak. map: a Scene
whose lamps' codes tell who says what. join_frames: lamps are looked for in the brightest of so
many frames; 0: of all, for a camera that stands still. exact_times: c_ook: times are good to a
quarter of a chip.
Returns: Decoded; status no_lamps when no frame shows a light.
Raises: ValueError naming the frame that is out of order, repeated or of another size, or a code
  that two lamps of the map say.)");
}

}  // namespace occ::python
