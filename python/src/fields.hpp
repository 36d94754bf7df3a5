// SPDX-License-Identifier: Apache-2.0
// Generates the Python class of a plain struct from its list of fields (core/internal/fields.hpp):
// the constructor's keywords, read-only properties with documentation, repr, `replace` and
// pickling. Also generates the keyword options of functions that take an options struct. Defaults
// come from the C++ struct. Structs without rules may list their fields by field(name, member,
// doc).
#pragma once

#include <pybind11/eigen.h>
#include <pybind11/native_enum.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/typing.h>

#include <array>
#include <cmath>
#include <deque>
#include <optional>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>

#include "casters.hpp"
#include "libocc/core/internal/fields.hpp"

namespace occ::python {

namespace py = pybind11;

using internal::core::Field;
using internal::core::for_each_field;
using internal::core::MemberAccess;
using internal::core::NestedAccess;
using internal::core::Unrestricted;
using internal::core::Word;

/// A field without rule, whose `doc` contains shape and unit.
template <class C, class T>
auto field(const char* name, T C::*member, const char* doc) {
  return Field<C, T, MemberAccess<C, T>, Unrestricted, false>{name, nullptr, doc, {member}, {}};
}

template <class C, class T>
auto required_field(const char* name, T C::*member, const char* doc) {
  return Field<C, T, MemberAccess<C, T>, Unrestricted, true>{name, nullptr, doc, {member}, {}};
}

/// The fields of an options struct that are keyword options of functions: all except ByHand fields.
template <class... Fields>
auto options_of(const std::tuple<Fields...>& fields) {
  const auto kept = [](const auto& field) {
    using Rule = decltype(std::decay_t<decltype(field)>::rule);
    if constexpr (std::is_same_v<Rule, internal::core::ByHand>)
      return std::make_tuple();
    else
      return std::make_tuple(field);
  };
  return std::apply([&](const auto&... field) { return std::tuple_cat(kept(field)...); }, fields);
}

/// Renames one field.
template <class... Fields>
std::tuple<Fields...> renamed(std::tuple<Fields...> fields, const std::string& from,
                              const char* to) {
  const auto rename = [&](auto& field) {
    if (field.name == from) field.name = to;
  };
  std::apply([&](auto&... field) { (rename(field), ...); }, fields);
  return fields;
}

/// The fields of a member struct as fields of the struct that contains it.
template <class Outer, class C, class... Fields>
auto fields_within(C Outer::*member, const std::tuple<Fields...>& fields) {
  const auto nest = [member](const auto& inner) {
    using F = std::decay_t<decltype(inner)>;
    using Access = NestedAccess<Outer, C, decltype(F::access)>;
    return Field<Outer, typename F::value_type, Access, Unrestricted, false>{
        inner.name, inner.unit, inner.help, {member, inner.access}, {}};
  };
  return std::apply([&](const auto&... inner) { return std::make_tuple(nest(inner)...); }, fields);
}

/// "(3,) " or "(2, 2) " for a matrix of fixed size, else "".
template <class T>
std::string shape_text() {
  if constexpr (internal::core::is_optional_v<T>) {
    return shape_text<typename T::value_type>();
  } else if constexpr (std::is_base_of_v<Eigen::PlainObjectBase<T>, T>) {
    if (T::ColsAtCompileTime == 1) return "(" + std::to_string(T::RowsAtCompileTime) + ",) ";
    return "(" + std::to_string(T::RowsAtCompileTime) + ", " +
           std::to_string(T::ColsAtCompileTime) + ") ";
  } else {
    return "";
  }
}

/// Shape, help, range and unit of a field: "(3,) centre in the world [m]".
template <class F>
std::string field_doc(const F& field) {
  if (!field.unit) return field.help;
  using Rule = decltype(F::rule);
  std::string text = shape_text<typename F::value_type>() + field.help;
  if constexpr (std::is_same_v<Rule, internal::core::Interval> ||
                std::is_same_v<Rule, internal::core::Angle>)
    text += ", " + field.rule.text(0.0);
  const std::string unit = field.unit;
  return text + (unit.empty() ? "" : " [" + unit + "]");
}

/// Defines a Python enumeration with the names that files use.
template <class T, std::size_t count>
void define_enum(py::module_& m, const char* name, const char* doc,
                 const std::array<Word<T>, count>& words) {
  py::native_enum<T> values(m, name, "enum.Enum", doc);
  for (const Word<T>& word : words) values.value(word.text, word.value);
  values.finalize();
}

/// Python's repr of a value, with arrays as nested lists. Adding 0 turns -0 into 0.
template <class T>
std::string value_repr(const T& value) {
  py::object object = py::cast(value);
  if (py::isinstance<py::array>(object)) object = (object + py::float_(0.0)).attr("tolist")();
  if constexpr (std::is_enum_v<T>)
    return py::cast<std::string>(py::str(py::type::of(object).attr("__name__"))) + "." +
           py::cast<std::string>(object.attr("name"));
  return py::cast<std::string>(py::repr(object));
}

/// Texts of default values in signatures. They must exist until the function is defined, because
/// pybind11 copies them then.
using DefaultTexts = std::deque<std::string>;

template <class C, class T, class Access, class Rule, bool is_required>
auto argument(const Field<C, T, Access, Rule, is_required>& field, DefaultTexts& texts) {
  if constexpr (is_required) {
    return py::arg(field.name);
  } else {
    const C defaults{};
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

/// Returns a C with these values of its fields; validated if C has validate().
template <class C, class... F>
C from_values(const std::tuple<F...>& fields, const typename F::value_type&... values) {
  return assembled<C>(fields, std::forward_as_tuple(values...), std::index_sequence_for<F...>{});
}

/// "\n\n  name: doc" for each field, for a docstring.
template <class... F>
std::string fields_doc(const std::tuple<F...>& fields, const char* title) {
  std::string text = std::string("\n\n") + title + ":\n";
  for_each_field(fields, [&](const auto& f) {
    text += std::string("  ") + f.name + ": " + field_doc(f) + "\n";
  });
  return text;
}

/// Defines a documented read-only property for each field.
template <class C, class... Extra, class... F>
void define_properties(py::class_<C, Extra...>& cls, const std::tuple<F...>& fields) {
  for_each_field(fields, [&](const auto& f) {
    using T = typename std::decay_t<decltype(f)>::value_type;
    cls.def_property_readonly(
        f.name, [get = f.access](const C& object) -> const T& { return get(object); },
        field_doc(f).c_str());
  });
}

/// "Name(field=value, ...)" of the fields that differ from their defaults.
template <class C, class... F>
std::string fields_repr(const char* name, const C& object, const std::tuple<F...>& fields) {
  std::string text;
  const C defaults{};
  for_each_field(fields, [&](const auto& f) {
    const std::string value = value_repr(f.access(object));
    if (value == value_repr(f.access(defaults))) return;
    text += (text.empty() ? "" : ", ") + std::string(f.name) + "=" + value;
  });
  return std::string(name) + "(" + text + ")";
}

template <class C, class... Extra, class... F>
void define_repr(py::class_<C, Extra...>& cls, const char* name, const std::tuple<F...>& fields) {
  cls.def("__repr__",
          [fields, name](const C& object) { return fields_repr(name, object, fields); });
}

/// Returns a copy of an object with some fields changed, by name.
template <class C, class... F>
C replaced(C object, const py::dict& changes, const std::tuple<F...>& fields) {
  std::size_t used = 0;
  for_each_field(fields, [&](const auto& f) {
    using T = typename std::decay_t<decltype(f)>::value_type;
    if (!changes.contains(f.name)) return;
    ++used;
    py::detail::make_caster<T> caster;
    if (!caster.load(changes[f.name], true))
      throw py::type_error(std::string(f.name) + ": unsuitable value " +
                           py::cast<std::string>(py::repr(changes[f.name])));
    f.access(object) = py::detail::cast_op<T&&>(std::move(caster));
  });
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

template <class C, class... F>
inline constexpr bool lists_all_members = [] {
  if constexpr (std::is_aggregate_v<C> &&
                (std::is_same_v<decltype(F::access), MemberAccess<C, typename F::value_type>> &&
                 ...))
    return sizeof...(F) == internal::core::member_count<C>();
  else
    return true;  // members of classes with constructors and of nested structs cannot be counted
}();

/// Pickling as a dictionary of the fields.
template <class C, class... Extra, class... F>
void define_pickling(py::class_<C, Extra...>& cls, const std::tuple<F...>& fields) {
  static_assert(lists_all_members<C, F...>, "a pickled object would lose the missing fields");
  cls.def(py::pickle(
      [fields](const C& object) {
        State state;
        for_each_field(fields, [&](const auto& f) {
          state[f.name] = py::cast(f.access(object), py::return_value_policy::copy);
        });
        return state;
      },
      [fields](const State& state) { return replaced(C{}, state, fields); }));
}

/// Defines constructor, properties, `replace` and pickling of an immutable value, but no repr.
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
      "Returns a copy with the given fields changed.");
  define_pickling(cls, fields);
}

/// Defines the whole class of a plain struct.
template <class C, class Fields>
void define_documented(py::module_& m, const char* name, const std::string& doc,
                       const Fields& fields) {
  py::class_<C> cls(m, name, (doc + fields_doc(fields, "Keywords (and properties)")).c_str());
  define_value(cls, fields);
  define_repr(cls, name, fields);
}

}  // namespace occ::python
