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

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>

#include "casters.hpp"
#include "keywords.hpp"
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

/// The fields as keywords.
template <class C, class... T, class... Access, class... Rule, bool... required>
Keywords keywords_of(const std::tuple<Field<C, T, Access, Rule, required>...>& fields) {
  Keywords keywords{&ClassTableOf<C>::table, {}};
  for_each_field(fields, [&](const auto& f) {
    using F = std::decay_t<decltype(f)>;
    keywords.list.push_back({f.name, field_doc(f), F::is_required, offset_of<C>(f.access),
                             &ConversionsOf<typename F::value_type>::table});
  });
  return keywords;
}

template <class... F>
std::string fields_doc(const std::tuple<F...>& fields, const char* title) {
  return fields_doc(keywords_of(fields), title);
}

template <class... F>
void define_properties(py::object& cls, const std::tuple<F...>& fields) {
  define_properties(cls, keywords_of(fields));
}

template <class... F>
void define_repr(py::object& cls, const char* name, const std::tuple<F...>& fields) {
  define_repr(cls, name, keywords_of(fields));
}

template <class C, class... F>
inline constexpr bool lists_all_members = [] {
  if constexpr (std::is_aggregate_v<C> &&
                (std::is_same_v<decltype(F::access), MemberAccess<C, typename F::value_type>> &&
                 ...))
    return sizeof...(F) == internal::core::member_count<C>();
  else
    return true;  // members of classes with constructors and of nested structs cannot be counted
}();

template <class C, class... Extra, class... F>
void define_value(py::class_<C, Extra...>& cls, const std::tuple<F...>& fields) {
  static_assert(lists_all_members<C, F...>, "a pickled object would lose the missing fields");
  define_value(cls, keywords_of(fields));
}

/// Defines the whole class of a plain struct.
template <class C, class Fields>
void define_documented(py::module_& m, const char* name, const std::string& doc,
                       const Fields& fields) {
  const Keywords keywords = keywords_of(fields);
  py::class_<C> cls(m, name, (doc + fields_doc(keywords, "Keywords (and properties)")).c_str());
  define_value(cls, fields);
  define_repr(cls, name, keywords);
}

/// Defines a function that calls body(options, arguments...). extra: annotations of the arguments,
/// py::kw_only() and the documentation, as for py::module_::def(). The fields of the options are
/// keywords after the arguments. The options are validated before the call.
template <class Fields, class Body, class... Extra>
void define_function(py::module_& m, const char* name, const Fields& fields, const Body& body,
                     const Extra&... extra) {
  m.add_object(name,
               options_function(body, keywords_of(fields), py::name(name), py::scope(m),
                                py::sibling(py::getattr(m, name, py::none())), extra...),
               true);
}

/// Defines a method in the same way; the first argument is the object.
template <class Fields, class Body, class... Extra>
void define_method(py::object& cls, const char* name, const Fields& fields, const Body& body,
                   const Extra&... extra) {
  cls.attr(name) = options_function(body, keywords_of(fields), py::name(name), py::is_method(cls),
                                    py::sibling(py::getattr(cls, name, py::none())), extra...);
}

template <class C, class Body, class Options, class... Head>
auto constructing(const Body& body, C (*)(Options, Head...)) {
  return [body](Options options, py::detail::value_and_holder& holder, Head... arguments) {
    holder.value_ptr() = new C(body(std::move(options), std::forward<Head>(arguments)...));
  };
}

/// Defines a constructor of C in the same way; body(options, arguments...) returns the object.
template <class C, class Fields, class Body, class... Extra>
void define_constructor(py::class_<C>& cls, const Fields& fields, const Body& body,
                        const Extra&... extra) {
  using Called = py::detail::function_signature_t<Body>;
  define_method(cls, "__init__", fields, constructing<C>(body, static_cast<Called*>(nullptr)),
                py::detail::is_new_style_constructor(), extra...);
}

}  // namespace occ::python
