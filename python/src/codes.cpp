// SPDX-License-Identifier: Apache-2.0
#include <pybind11/numpy.h>

#include "fields.hpp"
#include "libocc/codes/budget.hpp"
#include "libocc/codes/code.hpp"
#include "libocc/codes/decode_samples.hpp"
#include "libocc/core/require.hpp"
#include "libocc/scene/internal/scene_fields.hpp"
#include "libocc/scene/lamp.hpp"
#include "module.hpp"
#include "results.hpp"

namespace occ::python {

using namespace internal::codes;
using internal::scene::lamp_code_fields;
namespace {

auto samples_fields() {
  using O = DecodeSamplesOptions;
  return std::make_tuple(
      field("max_clock_error", &O::max_clock_error,
            "search range: relative clock error of lamp against camera"),
      field("max_expected_errors", &O::max_expected_errors,
            "more expected wrong bits give the status `uncertain`"),
      field("exact_times", &O::exact_times,
            "c_ook: times are accurate to a quarter of a chip, so frames are decoded together"),
      field("period_start_s", &O::period_start_s,
            "known start of a period, for measuring error rates"));
}

void define_code_enums(py::module_& m) {
  define_enum(m, "CodeKind", "Kind of code by which a lamp transmits its id.", code_kind_words);
  py::native_enum<LineCode>(m, "LineCode", "enum.Enum", "Mapping from bits to chips.")
      .value("manchester", LineCode::manchester)
      .value("code_4b6b", LineCode::code_4b6b)
      .finalize();
  define_enum(m, "Checksum", "Checksum of an id: 8 or 16 bits.", checksum_words);
  py::native_enum<CodeStatus>(m, "CodeStatus", "enum.Enum", "Result of decoding a code.")
      .value("ok", CodeStatus::ok)
      .value("no_signal", CodeStatus::no_signal)
      .value("incomplete", CodeStatus::incomplete)
      .value("uncertain", CodeStatus::uncertain)
      .value("checksum_failed", CodeStatus::checksum_failed)
      .finalize();
}

void define_code_results(py::module_& m) {
  ResultClass<Waveform>(m, "Waveform", "Light of a lamp over one period, which repeats.")
      .def_readonly("chips", &Waveform::chips,
                    "Per channel: light relative to its maximum, in equal time steps.")
      .def_readonly("chip_rate_hz", &Waveform::chip_rate_hz, "Rate of the time steps [Hz].")
      .def_property_readonly("frequency_hz", &Waveform::frequency_hz,
                             "Repetition rate of the period [Hz].")
      .def("__repr__", [](const Waveform& w) {
        return "<Waveform: " + std::to_string(w.chips.size()) + " x " +
               std::to_string(w.chips.front().size()) + " chips, " + value_repr(w.chip_rate_hz) +
               " Hz>";
      });
  using D = DecodedCode;
  ResultClass<D>(m, "DecodedCode", "A decoded id, or the reason why there is none.")
      .def_property_readonly("ok", &D::ok, "True if status is CodeStatus.ok.")
      .def_readonly("status", &D::status, "CodeStatus.")
      .def_readonly("message", &D::message, "Reason for another status than ok; may be empty.")
      .def_readonly("id", &D::id, "Decoded id; None unless ok.")
      .def_readonly("bits", &D::bits, "Decided bits: id and checksum.")
      .def_readonly("margins", &D::margins,
                    "Log likelihood ratio of each bit against its opposite.")
      .def_readonly("expected_errors", &D::expected_errors, "Expected number of wrong bits.")
      .def_readonly("explained", &D::explained,
                    "Part of the variance beyond noise that the transmitted light explains.")
      .def_readonly("clock_error", &D::clock_error, "Relative clock error of the lamp.")
      .def_readonly("frames", &D::frames, "Number of frames with samples.")
      .def("__repr__", [](const D& d) {
        return std::string("<DecodedCode: ") + to_string(d.status) +
               (d.id ? ", id " + std::to_string(*d.id) : ", " + d.message) + ">";
      });
  using B = CodeBudget;
  ResultClass<B>(m, "CodeBudget", "Result of code_budget(): can a camera read a code?")
      .def_readonly("fits", &B::fits, "True if the camera can read the code.")
      .def_readonly("message", &B::message, "Reason with numbers if it cannot; else empty.")
      .def_readonly("chips_in_view", &B::chips_in_view, "Chips in one image of the lamp.")
      .def_readonly("chips_needed", &B::chips_needed, "Chips required in one image of the lamp.")
      .def_readonly("exposure_chips", &B::exposure_chips,
                    "Length of the exposure [chips; ufsook, s2psk: half periods].")
      .def_readonly("row_chips", &B::row_chips, "Time from row to row [chips].")
      .def_readonly("period_s", &B::period_s, "Duration of the whole packet [s].")
      .def_readonly("frames_needed", &B::frames_needed,
                    "Approximate number of frames for the whole packet.")
      .def("__repr__", [](const B& b) {
        return "<CodeBudget: " + (b.fits ? std::string("fits") : b.message) + ">";
      });
}

using Column = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Indices = py::array_t<int, py::array::c_style | py::array::forcecast>;

std::vector<LightSample> samples_of(const Column& start_s, double exposure_s, const Column& values,
                                    double sigma, const std::optional<Indices>& channels,
                                    const std::optional<Indices>& frames) {
  const py::ssize_t n = start_s.size();
  require(values.size() == n, "values", values.size(), "as many as start_s");
  if (channels) require(channels->size() == n, "channels", channels->size(), "as many as start_s");
  if (frames) require(frames->size() == n, "frames", frames->size(), "as many as start_s");
  std::vector<LightSample> samples(static_cast<std::size_t>(n));
  for (py::ssize_t i = 0; i < n; ++i)
    samples[i] = {start_s.data()[i],
                  exposure_s,
                  values.data()[i],
                  sigma,
                  channels ? channels->data()[i] : 0,
                  frames ? frames->data()[i] : 0};
  return samples;
}

void define_code_functions(py::module_& m) {
  m.def("encode_id", &encode_id, py::arg("id"), py::arg("code"),
        R"(Returns the Waveform of a lamp that transmits an id.

Raises: ValueError for an invalid code or an id of too many bits, naming the field.

>>> import libocc as occ
>>> occ.codes.encode_id(17, occ.codes.Code(kind=occ.codes.CodeKind.c_ook))
<Waveform: 1 x 288 chips, 10000.0 Hz>)");
  m.def("code_budget", &code_budget, py::arg("code"), py::kw_only(), py::arg("rows"),
        py::arg("row_time_s"), py::arg("exposure_s"), py::arg("exact_times") = false,
        R"(Computes if a camera can read a code from a lamp's image with this number of rows.

rows: height of the lamp's image [px]. Chips in view = rows x row time x clock; an exposure longer
than a chip mixes it with the next. Returns: CodeBudget.)");
  const auto fields = samples_fields();
  define_function(
      m, "decode_samples", fields,
      [](DecodeSamplesOptions options, const Code& code, const Column& start_s, double exposure_s,
         const Column& values, double sigma, const std::optional<Indices>& channels,
         const std::optional<Indices>& frames) {
        const auto samples = samples_of(start_s, exposure_s, values, sigma, channels, frames);
        py::gil_scoped_release unlocked;
        return decode_samples(samples, code, options);
      },
      py::arg("code"), py::arg("start_s"), py::arg("exposure_s"), py::arg("values"),
      py::arg("sigma"), py::arg("channels") = py::none(), py::arg("frames") = py::none(),
      py::kw_only(),
      (R"(Decodes an id from samples of a lamp's light; returns a DecodedCode.

start_s: (n,) start of each exposure. values: (n,) mean light, about 0 (dark) to 1 (lit). sigma:
standard deviation of each value. channels: (n,) see Waveform. frames: (n,) index of the image.)" +
       fields_doc(fields, "Options"))
          .c_str());
}

}  // namespace

void define_codes(py::module_& m) {
  define_code_enums(m);
  define_documented<Code>(m, "Code", "A code by which a lamp transmits its id.", code_fields);
  define_documented<LampCode>(m, "LampCode", "The code and the id that a lamp transmits.",
                              lamp_code_fields);
  define_code_results(m);
  define_code_functions(m);
}

}  // namespace occ::python
