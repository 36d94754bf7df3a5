// SPDX-License-Identifier: Apache-2.0
// One table of fields per plain struct says its Python side: the constructor's keywords, read-only
// properties, repr, `replace` and pickling; and the keyword options of the functions that take it.
// Defaults come from the C++ struct, so they are written once.
#pragma once

#include <pybind11/eigen.h>
#include <pybind11/native_enum.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/typing.h>

#include <cmath>
#include <deque>
#include <optional>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>

#include "casters.hpp"

namespace occ::python {

namespace py = pybind11;

/// `access(C&)` gives the field's reference; without `is_required` the struct's default holds.
template <class C, class T, class Access, bool is_required>
struct Field {
  using value_type = T;
  const char* name;
  const char* doc;
  Access access;
};

template <class C, class T>
auto field(const char* name, T C::*member, const char* doc) {
  const auto access = [member](C& object) -> T& { return object.*member; };
  return Field<C, T, decltype(access), false>{name, doc, access};
}

template <class C, class T>
auto required_field(const char* name, T C::*member, const char* doc) {
  const auto access = [member](C& object) -> T& { return object.*member; };
  return Field<C, T, decltype(access), true>{name, doc, access};
}

/// The fields of a member struct as fields of the struct that contains it.
template <class Outer, class C, class... Fields>
auto fields_within(C Outer::*member, const std::tuple<Fields...>& fields) {
  const auto nest = [member](const auto& inner) {
    using T = typename std::decay_t<decltype(inner)>::value_type;
    const auto access = [member, get = inner.access](Outer& object) -> T& {
      return get(object.*member);
    };
    return Field<Outer, T, decltype(access), false>{inner.name, inner.doc, access};
  };
  return std::apply([&](const auto&... inner) { return std::make_tuple(nest(inner)...); }, fields);
}

/// Python's repr of a value, arrays as nested lists (adding 0 makes -0 a plain 0).
template <class T>
std::string value_repr(const T& value) {
  py::object object = py::cast(value);
  if (py::isinstance<py::array>(object)) object = (object + py::float_(0.0)).attr("tolist")();
  if constexpr (std::is_enum_v<T>)
    return py::cast<std::string>(py::str(py::type::of(object).attr("__name__"))) + "." +
           py::cast<std::string>(object.attr("name"));
  return py::cast<std::string>(py::repr(object));
}

/// Signature texts of default values: alive until the function is defined, when pybind11 copies
/// them.
using DefaultTexts = std::deque<std::string>;

template <class C, class T, class Access, bool is_required>
auto argument(const Field<C, T, Access, is_required>& field, DefaultTexts& texts) {
  if constexpr (is_required) {
    return py::arg(field.name);
  } else {
    C defaults{};
    const T& value = field.access(defaults);
    texts.push_back(value_repr(value));
    if constexpr (std::is_floating_point_v<T>)
      if (std::isinf(value)) texts.back() = "float('inf')";
    return py::arg_v(field.name, value, texts.back().c_str());
  }
}

template <class C, class = void>
struct has_validate : std::false_type {};
template <class C>
struct has_validate<C, std::void_t<decltype(std::declval<C&>().validate())>> : std::true_type {};

template <class C>
C validated(C object) {
  if constexpr (has_validate<C>::value) object.validate();
  return object;
}

template <class C, class Fields, class Values, std::size_t... i>
C assembled(const Fields& fields, Values&& values, std::index_sequence<i...>) {
  C object{};
  ((std::get<i>(fields).access(object) = std::get<i>(std::forward<Values>(values))), ...);
  return validated(std::move(object));
}

/// A C whose fields have these values.
template <class C, class... F>
C from_values(const std::tuple<F...>& fields, const typename F::value_type&... values) {
  return assembled<C>(fields, std::forward_as_tuple(values...), std::index_sequence_for<F...>{});
}

/// "\n\n  name: doc" for each field, for a docstring.
template <class... F>
std::string fields_doc(const std::tuple<F...>& fields, const char* title) {
  std::string text = std::string("\n\n") + title + ":\n";
  const auto add = [&](const auto& f) { text += std::string("  ") + f.name + ": " + f.doc + "\n"; };
  std::apply([&](const auto&... f) { (add(f), ...); }, fields);
  return text;
}

/// Read-only properties, documented.
template <class C, class... Extra, class... F>
void define_properties(py::class_<C, Extra...>& cls, const std::tuple<F...>& fields) {
  const auto define = [&](const auto& f) {
    using T = typename std::decay_t<decltype(f)>::value_type;
    cls.def_property_readonly(
        f.name,
        [get = f.access](const C& object) -> const T& { return get(const_cast<C&>(object)); },
        f.doc);
  };
  std::apply([&](const auto&... f) { (define(f), ...); }, fields);
}

/// "Name(field=value, ...)" of the fields that differ from their defaults.
template <class C, class... F>
std::string fields_repr(const char* name, const C& object, const std::tuple<F...>& fields) {
  std::string text;
  C defaults{};
  const auto add = [&](const auto& f) {
    const std::string value = value_repr(f.access(const_cast<C&>(object)));
    if (value == value_repr(f.access(defaults))) return;
    text += (text.empty() ? "" : ", ") + std::string(f.name) + "=" + value;
  };
  std::apply([&](const auto&... f) { (add(f), ...); }, fields);
  return std::string(name) + "(" + text + ")";
}

template <class C, class... Extra, class... F>
void define_repr(py::class_<C, Extra...>& cls, const char* name, const std::tuple<F...>& fields) {
  cls.def("__repr__",
          [fields, name](const C& object) { return fields_repr(name, object, fields); });
}

/// The same object with some fields changed, by name.
template <class C, class... F>
C replaced(C object, const py::dict& changes, const std::tuple<F...>& fields) {
  std::size_t used = 0;
  const auto set = [&](const auto& f) {
    using T = typename std::decay_t<decltype(f)>::value_type;
    if (!changes.contains(f.name)) return;
    ++used;
    py::detail::make_caster<T> caster;
    if (!caster.load(changes[f.name], true))
      throw py::type_error(std::string(f.name) + ": unsuitable value " +
                           py::cast<std::string>(py::repr(changes[f.name])));
    f.access(object) = py::detail::cast_op<T&&>(std::move(caster));
  };
  std::apply([&](const auto&... f) { (set(f), ...); }, fields);
  if (used != changes.size()) {
    for (const auto& item : changes) {
      const auto name = py::cast<std::string>(item.first);
      const bool known =
          std::apply([&](const auto&... f) { return ((name == f.name) || ...); }, fields);
      if (!known) throw py::type_error("no field is named " + name);
    }
  }
  return validated(std::move(object));
}

using State = py::typing::Dict<py::str, py::object>;

/// An immutable Python value with keywords (its repr is defined apart).
template <class C, class... Extra, class... F>
void define_value(py::class_<C, Extra...>& cls, const std::tuple<F...>& fields) {
  DefaultTexts texts;
  std::apply(
      [&](const auto&... f) {
        cls.def(py::init([fields](const typename F::value_type&... values) {
                  return from_values<C>(fields, values...);
                }),
                py::kw_only(), argument(f, texts)...);
      },
      fields);
  define_properties(cls, fields);
  cls.def(
      "replace",
      [fields](const C& object, const py::KWArgs<py::object>& changes) {
        return replaced(object, changes, fields);
      },
      "A copy with the given fields changed.");
  cls.def(py::pickle(
      [fields](const C& object) {
        State state;
        const auto add = [&](const auto& f) {
          state[f.name] = py::cast(f.access(const_cast<C&>(object)), py::return_value_policy::copy);
        };
        std::apply([&](const auto&... f) { (add(f), ...); }, fields);
        return state;
      },
      [fields](const State& state) { return replaced(C{}, state, fields); }));
}

/// A plain struct with all of that.
template <class C, class Fields>
void define_documented(py::module_& m, const char* name, const std::string& doc,
                       const Fields& fields) {
  py::class_<C> cls(m, name, (doc + fields_doc(fields, "Keywords (and properties)")).c_str());
  define_value(cls, fields);
  define_repr(cls, name, fields);
}

}  // namespace occ::python
