// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/effects.hpp"

#include <pybind11/typing.h>

#include "fields.hpp"
#include "libocc/scene/scene_file.hpp"
#include "module.hpp"

namespace occ::python {
namespace {

using Uses = py::typing::Dict<py::str, Use>;

Uses uses_of(const Effects& effects) {
  Uses uses;
  for (std::size_t i = 0; i < effect_count; ++i)
    uses[effect_name(static_cast<Effect>(i))] = py::cast(effects.use[i]);
  return uses;
}

Effects make_effects(Use standard, double tolerance_dn, double tolerance_px,
                     const py::KWArgs<Use>& uses) {
  Effects effects;
  effects.use.fill(standard);
  effects.tolerance_dn = tolerance_dn;
  effects.tolerance_px = tolerance_px;
  for (const auto& [name, use] : uses)
    effects.set(effect_named(py::cast<std::string>(name)), py::cast<Use>(use));
  effects.validate();
  return effects;
}

std::string effects_repr(const Effects& effects) {
  std::string text;
  const auto add = [&](const std::string& name, const std::string& value) {
    text += (text.empty() ? "" : ", ") + name + "=" + value;
  };
  for (std::size_t i = 0; i < effect_count; ++i)
    if (effects.use[i] != Use::on)
      add(effect_name(static_cast<Effect>(i)), value_repr(effects.use[i]));
  const Effects standard;
  if (effects.tolerance_dn != standard.tolerance_dn)
    add("tolerance_dn", value_repr(effects.tolerance_dn));
  if (effects.tolerance_px != standard.tolerance_px)
    add("tolerance_px", value_repr(effects.tolerance_px));
  return "Effects(" + text + ")";
}

}  // namespace

void define_effects(py::module_& m) {
  py::native_enum<Use>(
      m, "Use", "enum.Enum",
      "Use of an effect that the scene requires: rendered always, never, or if its "
      "bounds exceed the tolerances.")
      .value("on", Use::on)
      .value("off", Use::off)
      .value("automatic", Use::automatic)
      .finalize();
  const Effects standard;
  py::class_<Effects>(m, "Effects",
                      R"(Selects the effects that simulate() renders if the scene requires them.

default: Use of the effects that are not named. Further keywords: effects by name, see `use`.
tolerance_dn, tolerance_px: with Use.automatic, an effect is left out if it changes no pixel by more
grey levels and moves no lamp's centroid by more pixels.
Raises: ValueError for an unknown effect, naming the nearest known one.

>>> import libocc as occ
>>> occ.Effects(default=occ.rendering.Use.automatic, walls=occ.rendering.Use.off).use["walls"].name
'off')")
      .def(py::init(&make_effects), py::arg_v("default", Use::on, "Use.on"), py::kw_only(),
           py::arg("tolerance_dn") = standard.tolerance_dn,
           py::arg("tolerance_px") = standard.tolerance_px)
      .def_property_readonly("use", &uses_of, "Use of each effect, by name.")
      .def_readonly("tolerance_dn", &Effects::tolerance_dn,
                    "Largest change of a pixel [grey levels].")
      .def_readonly("tolerance_px", &Effects::tolerance_px,
                    "Largest displacement of a centroid [px].")
      .def("__repr__", &effects_repr)
      .def("__eq__",
           [](const Effects& a, const py::object& b) {
             if (!py::isinstance<Effects>(b)) return false;
             const auto& other = b.cast<const Effects&>();
             return a.use == other.use && a.tolerance_dn == other.tolerance_dn &&
                    a.tolerance_px == other.tolerance_px;
           })
      .def("__hash__", [](const Effects& e) { return py::hash(py::str(effects_repr(e))); })
      .def(py::pickle(
          [](const Effects& e) {
            State state;
            state["use"] = uses_of(e);
            state["tolerance_dn"] = py::float_(e.tolerance_dn);
            state["tolerance_px"] = py::float_(e.tolerance_px);
            return state;
          },
          [](const State& state) {
            return make_effects(Use::on, state["tolerance_dn"].cast<double>(),
                                state["tolerance_px"].cast<double>(),
                                state["use"].cast<py::KWArgs<Use>>());
          }));
}

}  // namespace occ::python
