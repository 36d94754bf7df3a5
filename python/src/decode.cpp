// SPDX-License-Identifier: Apache-2.0
#include "libocc/decode/decode.hpp"

#include "casters.hpp"
#include "fields.hpp"
#include "libocc/core/require.hpp"
#include "module.hpp"
#include "results.hpp"

namespace occ::python {
namespace {

/// Result of decode(): the lamps, and their blobs with the lamp ids of the map.
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
    auto named = identified_blobs(lamps.value, *map, options.code);
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
  ResultClass<L>(m, "DecodedLamp", "One lamp of an image sequence with its decoded id.")
      .def_property_readonly(
          "id", [](const L& l) { return l.code.id; }, "Decoded id, or None.")
      .def_readonly("code", &L::code, "DecodedCode.")
      .def_readonly("blob", &L::blob,
                    "Blob in the maximum of the frames around `frame`; without a rim for a moving "
                    "camera.")
      .def_readonly("frame", &L::frame, "Index of the frame of `blob`.")
      .def_readonly("budget", &L::budget, "CodeBudget of its image.")
      .def_readonly("reference", &L::reference, "s2psk: index of its reference lamp.")
      .def_property_readonly(
          "track_px", [](const L& l) { return places(l.track); },
          "(n, 2) position in each frame, dark or lit [px].")
      .def_property_readonly(
          "seen_frames",
          [](const L& l) {
            std::vector<int> frames;
            for (const TrackPoint& point : l.track.points)
              if (point.blob) frames.push_back(point.frame);
            return frames;
          },
          "Indices of the frames with a blob.")
      .def_property_readonly(
          "seen", [](const L& l) { return l.track.seen; }, "Number of frames with a blob.")
      .def("__repr__", [](const L& l) {
        return std::string("<DecodedLamp: ") +
               (l.code.id ? "id " + std::to_string(*l.code.id) : to_string(l.code.status)) + ">";
      });
  ResultClass<Result<Decoded>> result(m, "Decoded",
                                      "The lamps of an image sequence with their decoded ids.");
  define_result(result);
  result.def_property_readonly("lamps", value_of(&Decoded::lamps), "List of DecodedLamp.")
      .def_property_readonly(
          "blobs", value_of(&Decoded::blobs),
          "Their Blobs, with the lamp_id that the map assigns to the decoded id.");
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
      R"(Decodes the ids that lamps transmit, from the images of a sequence.

images: (height, width) arrays of one size and type. times_s: start of each exposure, increasing.
sensor: its row time and exposure give the exposure times of the lines. code: Code of the lamps.
map: a Scene whose lamps have codes and ids. join_frames: lamps are detected in the maximum of so
many frames; 0: of all frames, for a camera that does not move. exact_times: c_ook: times are
accurate to a quarter of a chip.
Returns: Decoded; status no_lamps when no lamp is detected in any frame.
Raises: ValueError naming the frame that is out of order, repeated or of another size, or an id
  that two lamps of the map transmit.)");
}

}  // namespace occ::python
