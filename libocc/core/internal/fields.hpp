// SPDX-License-Identifier: Apache-2.0
// The fields of a plain struct, listed once: name, unit, rule and help.
//
//   inline constexpr auto room_fields = fields_of<Room>(
//       field("size_m", &Room::size_m, "m", PositiveLengths{}, "sides of the room"),
//       field("wall_reflectance", &Room::wall_reflectance, "", Interval{'[', 0, 1, ')'}, "..."));
//
// These walk the list: validate() (check_fields below), the reader and the writer of YAML files
// (yaml_fields.hpp), the Python binding with repr and pickling (python/src/fields.hpp) and the key
// tables of data/scenes/README.md (tests/scene/key_tables_test.cpp compares them).
// A list that misses a member of its struct does not compile.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <sstream>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>

#include "libocc/core/internal/vector_text.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"

namespace occ::internal::core {

// Rules: `holds(value)` decides and `text(value)` completes the message "NAME must be TEXT, got
// VALUE". A rule on an optional field applies to the value inside.

/// Every value is allowed.
struct Unrestricted {
  template <class T>
  bool holds(const T&) const {
    return true;
  }
  template <class T>
  std::string text(const T&) const {
    return "";
  }
};

/// A field that generic code leaves out: in files it is nested or conditional, so the struct's own
/// reader and writer treat it; in Python it is no keyword option but an argument by itself.
struct ByHand : Unrestricted {};

/// A list that files show as `[]` when it is empty; other lists are then left out.
struct WrittenWhenEmpty : Unrestricted {};

struct Finite {
  bool holds(double value) const { return std::isfinite(value); }
  template <class Derived>
  bool holds(const Eigen::MatrixBase<Derived>& value) const {
    return value.allFinite();
  }
  template <class T>
  std::string text(const T&) const {
    return "finite";
  }
};

struct Positive {
  bool holds(double value) const { return value > 0 && std::isfinite(value); }
  template <class T>
  std::string text(const T&) const {
    return "positive";
  }
};

/// Each coordinate is positive, and may be infinite.
struct PositiveOrInfinite {
  bool holds(double value) const { return value > 0; }
  template <class Derived>
  bool holds(const Eigen::MatrixBase<Derived>& value) const {
    return (value.array() > 0).all();
  }
  template <class T>
  std::string text(const T&) const {
    return "positive";
  }
};

struct NotNegative {
  bool holds(double value) const { return value >= 0 && std::isfinite(value); }
  template <class Derived>
  bool holds(const Eigen::MatrixBase<Derived>& value) const {
    return value.allFinite() && value.minCoeff() >= 0;
  }
  template <class T>
  std::string text(const T&) const {
    return "zero or positive";
  }
};

/// At least zero, and may be infinite.
struct NotNegativeOrInfinite {
  bool holds(double value) const { return value >= 0; }
  template <class T>
  std::string text(const T&) const {
    return "zero or positive";
  }
};

struct AtLeast {
  int low;

  bool holds(double value) const { return value >= low && std::isfinite(value); }
  template <class T>
  std::string text(const T&) const {
    return "at least " + std::to_string(low);
  }
};

/// low and high are included where the bracket is square.
struct Interval {
  char left = '[';
  double low = 0;
  double high = 1;
  char right = ']';

  bool holds(double value) const {
    return (left == '[' ? value >= low : value > low) &&
           (right == ']' ? value <= high : value < high);
  }
  template <class T>
  std::string text(const T&) const {
    std::ostringstream out;
    out << "in " << left << low << ", " << high << right;
    return out.str();
  }
};

/// An angle from 0 (excluded) to a limit: radians in the library, degrees in files.
struct Angle {
  int limit_deg = 90;
  char right = ')';  ///< ']': the limit is allowed

  bool holds(double value_rad) const {
    const double limit_rad = limit_deg / 180.0 * pi;
    return value_rad > 0 && (right == ']' ? value_rad <= limit_rad : value_rad < limit_rad);
  }
  template <class T>
  std::string text(const T&) const {
    return std::string(limit_deg == 90 ? "in (0, pi/2" : "in (0, pi") + right;
  }
};

/// A vector of any finite length but zero.
struct Direction {
  template <class Derived>
  bool holds(const Eigen::MatrixBase<Derived>& value) const {
    return value.allFinite() && value.stableNorm() > 1e-9;
  }
  template <class Derived>
  std::string text(const Eigen::MatrixBase<Derived>& value) const {
    return value.allFinite() ? "a direction, not zero" : "finite";
  }
};

/// A vector whose length is 1 to a thousandth: sensors and files give few digits.
struct UnitVector {
  template <class Derived>
  bool holds(const Eigen::MatrixBase<Derived>& value) const {
    return std::abs(value.norm() - 1) < 1e-3;
  }
  template <class T>
  std::string text(const T&) const {
    return "a unit vector";
  }
};

struct PositiveLengths {
  template <class Derived>
  bool holds(const Eigen::MatrixBase<Derived>& value) const {
    return value.allFinite() && value.minCoeff() > 0;
  }
  template <class Derived>
  std::string text(const Eigen::MatrixBase<Derived>& value) const {
    return value.size() == 2 ? "two positive lengths" : "three positive lengths";
  }
};

/// An enumerator and its name in files and in Python.
template <class T>
struct Word {
  const char* text;
  T value;
};

/// An enumerator that has a name.
template <class T, std::size_t count>
struct OneOf : Unrestricted {
  std::array<Word<T>, count> words;
};

template <class T, std::size_t count>
constexpr OneOf<T, count> one_of(const std::array<Word<T>, count>& words) {
  return {{}, words};
}

/// Access to a member: `access(object)` is a reference to it.
template <class C, class T>
struct MemberAccess {
  T C::*pointer;

  constexpr T& operator()(C& object) const { return object.*pointer; }
  constexpr const T& operator()(const C& object) const { return object.*pointer; }
};

/// Access to a member of a member struct.
template <class Outer, class C, class Access>
struct NestedAccess {
  C Outer::*outer;
  Access inner;

  constexpr auto& operator()(Outer& object) const { return inner(object.*outer); }
  constexpr const auto& operator()(const Outer& object) const { return inner(object.*outer); }
};

/// One field of C of type T. A required field has no default: Python's constructor and files must
/// give it.
template <class C, class T, class Access, class Rule, bool required>
struct Field {
  using value_type = T;
  static constexpr bool is_required = required;

  const char* name;
  const char* unit;  ///< "" for a pure number; null when the help contains unit and shape
  const char* help;
  Access access;
  Rule rule;
  bool needed_in_files = required;
  bool (*condition)(const C&) = nullptr;  ///< null: the field always applies

  constexpr bool applies_to(const C& object) const { return !condition || condition(object); }

  /// Returns this field, required in files but not in Python.
  constexpr Field needed() const {
    Field changed = *this;
    changed.needed_in_files = true;
    return changed;
  }
  /// Returns this field, restricted to objects for which `holds(object)`: elsewhere it is not read,
  /// written or checked. The fields that the condition depends on must be listed before this one.
  constexpr Field when(bool (*holds)(const C&)) const {
    Field changed = *this;
    changed.condition = holds;
    return changed;
  }
};

template <class C, class T, class Rule>
constexpr auto field(const char* name, T C::*member, const char* unit, Rule rule,
                     const char* help) {
  return Field<C, T, MemberAccess<C, T>, Rule, false>{name, unit, help, {member}, rule};
}

template <class C, class T, class Rule>
constexpr auto required_field(const char* name, T C::*member, const char* unit, Rule rule,
                              const char* help) {
  return Field<C, T, MemberAccess<C, T>, Rule, true>{name, unit, help, {member}, rule};
}

/// Converts to a value of any type, in unevaluated expressions only.
struct AnyValue {
  template <class T>
  operator T() const;
};

template <class C, class... Values>
constexpr auto can_be_made_of(int) -> decltype(C{std::declval<Values>()...}, true) {
  return true;
}
template <class C, class... Values>
constexpr bool can_be_made_of(...) {
  return false;
}

/// Number of members of an aggregate: the number of initialisers that it takes. An optional takes
/// nullopt, since AnyValue would convert to it in two ways.
template <class C, class... Values>
constexpr std::size_t member_count() {
  static_assert(std::is_aggregate_v<C>);
  if constexpr (can_be_made_of<C, Values..., const std::nullopt_t&>(0))
    return member_count<C, Values..., const std::nullopt_t&>();
  else if constexpr (can_be_made_of<C, Values..., AnyValue>(0))
    return member_count<C, Values..., AnyValue>();
  else
    return sizeof...(Values);
}

/// The list of all fields of C, in the order of files and of repr.
template <class C, class... Fields>
constexpr std::tuple<Fields...> fields_of(Fields... fields) {
  static_assert(sizeof...(Fields) == member_count<C>(), "the list must name every member once");
  return {fields...};
}

/// Calls `visit(field)` for each field of a list, in order.
template <class Visit, class... Fields>
constexpr void for_each_field(const std::tuple<Fields...>& fields, const Visit& visit) {
  std::apply([&](const auto&... field) { (visit(field), ...); }, fields);
}

template <class T>
inline constexpr bool is_optional_v = false;
template <class T>
inline constexpr bool is_optional_v<std::optional<T>> = true;

/// Throws std::invalid_argument "OWNERNAME must be RULE, got VALUE" for the first field that breaks
/// its rule. owner: a text such as "sensor.", or a function that returns it: it is called for
/// a faulty field only.
template <class C, class Owner, class... Fields>
void check_fields(const C& object, const std::tuple<Fields...>& fields, const Owner& owner) {
  const auto check = [&](const auto& field, const auto& value) {
    if (field.rule.holds(value)) return;
    std::string name;
    if constexpr (std::is_invocable_v<Owner>)
      name = owner();
    else
      name = owner;
    name += field.name;
    if constexpr (std::is_arithmetic_v<std::decay_t<decltype(value)>>)
      require(false, name, value, field.rule.text(value));
    else
      require(false, name, vector_text(value), field.rule.text(value));
  };
  for_each_field(fields, [&](const auto& field) {
    using F = std::decay_t<decltype(field)>;
    if constexpr (!std::is_base_of_v<Unrestricted, decltype(F::rule)>) {
      if (!field.applies_to(object)) return;
      const auto& value = field.access(object);
      if constexpr (is_optional_v<typename F::value_type>) {
        if (value) check(field, *value);
      } else {
        check(field, value);
      }
    }
  });
}

}  // namespace occ::internal::core
