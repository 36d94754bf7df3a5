// SPDX-License-Identifier: Apache-2.0
// Access to the members of any plain struct, and their conversion to Python objects for pickling.
// Structured bindings return the members, as in Boost.PFR, so there is no list that could miss one.
// A struct becomes a tuple of its converted members; enumerators become integers and lists of
// numbers become arrays.
#pragma once

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <array>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <type_traits>
#include <typeinfo>
#include <utility>
#include <vector>

#include "libocc/core/internal/fields.hpp"

namespace occ::python {

namespace py = pybind11;

/// References to the members of a plain struct without base classes. Specialise it for a struct
/// with a base class.
template <class C>
struct Members {
  static auto tie(C& object) {
    constexpr std::size_t count = internal::core::member_count<C>();
    static_assert(count <= 32, "add a line below");
    // clang-format off
#define OCC_TIE(n, ...)                                \
  if constexpr (count == n) {                          \
    auto& [__VA_ARGS__] = object;                      \
    return std::tie(__VA_ARGS__);                      \
  } else
  OCC_TIE(1, a)
  OCC_TIE(2, a, b)
  OCC_TIE(3, a, b, c)
  OCC_TIE(4, a, b, c, d)
  OCC_TIE(5, a, b, c, d, e)
  OCC_TIE(6, a, b, c, d, e, f)
  OCC_TIE(7, a, b, c, d, e, f, g)
  OCC_TIE(8, a, b, c, d, e, f, g, h)
  OCC_TIE(9, a, b, c, d, e, f, g, h, i)
  OCC_TIE(10, a, b, c, d, e, f, g, h, i, j)
  OCC_TIE(11, a, b, c, d, e, f, g, h, i, j, k)
  OCC_TIE(12, a, b, c, d, e, f, g, h, i, j, k, l)
  OCC_TIE(13, a, b, c, d, e, f, g, h, i, j, k, l, m)
  OCC_TIE(14, a, b, c, d, e, f, g, h, i, j, k, l, m, n)
  OCC_TIE(15, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o)
  OCC_TIE(16, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p)
  OCC_TIE(17, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q)
  OCC_TIE(18, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r)
  OCC_TIE(19, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s)
  OCC_TIE(20, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t)
  OCC_TIE(21, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u)
  OCC_TIE(22, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v)
  OCC_TIE(23, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w)
  OCC_TIE(24, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x)
  OCC_TIE(25, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y)
  OCC_TIE(26, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z)
  OCC_TIE(27, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z, aa)
  OCC_TIE(28, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z, aa, ab)
  OCC_TIE(29, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z, aa, ab, ac)
  OCC_TIE(30, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z, aa, ab, ac, ad)
  OCC_TIE(31, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z, aa, ab, ac, ad, ae)
  OCC_TIE(32, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z, aa, ab, ac, ad, ae, af)
    static_assert(count == 0);
#undef OCC_TIE
    // clang-format on
  }
};

template <class T>
inline constexpr bool is_list_v = false;
template <class T, class A>
inline constexpr bool is_list_v<std::vector<T, A>> = true;
template <class T, class A>
inline constexpr bool is_list_v<std::deque<T, A>> = true;

template <class T>
inline constexpr bool is_numbers_v = false;
template <class T, class A>
inline constexpr bool is_numbers_v<std::vector<T, A>> =
    std::is_arithmetic_v<T> && !std::is_same_v<T, bool>;

template <class T>
inline constexpr bool is_std_array_v = false;
template <class T, std::size_t n>
inline constexpr bool is_std_array_v<std::array<T, n>> = true;

template <class T>
inline constexpr bool is_map_v = false;
template <class K, class V>
inline constexpr bool is_map_v<std::map<K, V>> = true;

template <class T>
inline constexpr bool is_pair_v = false;
template <class A, class B>
inline constexpr bool is_pair_v<std::pair<A, B>> = true;

template <class T>
inline constexpr bool is_shared_v = false;
template <class T>
inline constexpr bool is_shared_v<std::shared_ptr<T>> = true;

using Objects = std::vector<py::object>;
py::object list_of(const Objects& items);
py::object tuple_of(const Objects& items);
/// Elements of a sequence.
Objects elements_of(const py::object& sequence);
/// Throws ValueError if `state` does not have this number of elements.
Objects members_of(const py::object& state, std::size_t count, const std::type_info& type);

/// Converts a value to Python objects that can be pickled.
template <class T>
py::object packed(const T& value) {
  if constexpr (std::is_base_of_v<py::handle, T>) {
    return value;
  } else if constexpr (std::is_enum_v<T>) {
    return py::int_(static_cast<int>(value));
  } else if constexpr (internal::core::is_optional_v<T>) {
    return value ? tuple_of({packed(*value)}) : py::none();
  } else if constexpr (is_shared_v<T>) {
    return value ? tuple_of({packed(*value)}) : py::none();
  } else if constexpr (is_numbers_v<T>) {
    return py::array_t<typename T::value_type>(static_cast<py::ssize_t>(value.size()),
                                               value.data());
  } else if constexpr (is_list_v<T> || is_std_array_v<T>) {
    Objects items;
    for (const typename T::value_type& item : value) items.push_back(packed(item));
    return list_of(items);
  } else if constexpr (is_map_v<T>) {
    Objects items;
    for (const auto& [key, item] : value) items.push_back(tuple_of({packed(key), packed(item)}));
    return list_of(items);
  } else if constexpr (is_pair_v<T>) {
    return tuple_of({packed(value.first), packed(value.second)});
  } else if constexpr (std::is_aggregate_v<T>) {
    return std::apply([](const auto&... member) { return tuple_of({packed(member)...}); },
                      Members<T>::tie(const_cast<T&>(value)));
  } else {
    return py::cast(value, py::return_value_policy::copy);
  }
}

template <class T>
T unpacked(const py::object& state);

/// Sets a value from the result of packed(). Throws ValueError when the numbers of members differ,
/// as in a file written by another version.
template <class T>
void unpack(const py::object& state, T& value) {
  if constexpr (std::is_enum_v<T>) {
    value = static_cast<T>(state.cast<int>());
  } else if constexpr (internal::core::is_optional_v<T>) {
    value.reset();
    if (!state.is_none()) value.emplace(unpacked<typename T::value_type>(elements_of(state).at(0)));
  } else if constexpr (is_shared_v<T>) {
    value.reset();
    if (state.is_none()) return;
    using Element = std::remove_const_t<typename T::element_type>;
    value = std::make_shared<Element>(unpacked<Element>(elements_of(state).at(0)));
  } else if constexpr (is_numbers_v<T>) {
    const auto numbers = state.cast<py::array_t<typename T::value_type>>();
    value.assign(numbers.data(), numbers.data() + numbers.size());
  } else if constexpr (is_list_v<T>) {
    value.clear();
    for (const py::object& item : elements_of(state))
      value.push_back(unpacked<typename T::value_type>(item));
  } else if constexpr (is_std_array_v<T>) {
    std::size_t i = 0;
    for (const py::object& item : elements_of(state)) unpack(item, value.at(i++));
  } else if constexpr (is_map_v<T>) {
    value.clear();
    using Item = std::pair<typename T::key_type, typename T::mapped_type>;
    for (const py::object& item : elements_of(state)) value.insert(unpacked<Item>(item));
  } else if constexpr (is_pair_v<T>) {
    const Objects items = elements_of(state);
    unpack(items.at(0), value.first);
    unpack(items.at(1), value.second);
  } else if constexpr (!std::is_base_of_v<py::handle, T> && std::is_aggregate_v<T>) {
    const auto members = Members<T>::tie(value);
    const Objects items = members_of(state, std::tuple_size_v<decltype(members)>, typeid(T));
    auto item = items.begin();
    std::apply([&](auto&... member) { (unpack(*item++, member), ...); }, members);
  } else {
    value = state.cast<T>();
  }
}

template <class T>
T unpacked(const py::object& state) {
  if constexpr (std::is_default_constructible_v<T>) {
    T value{};
    unpack(state, value);
    return value;
  } else {
    return state.cast<T>();
  }
}

}  // namespace occ::python
