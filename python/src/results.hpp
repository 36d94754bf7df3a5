// SPDX-License-Identifier: Apache-2.0
// Result structs in Python: read-only properties and pickling. A Result<T> is one flat object: its
// status beside the fields of its value.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "fields.hpp"
#include "libocc/core/status.hpp"

namespace occ::python {

/// Reads the member of the value inside a result.
template <class T, class M>
struct ValueMember {
  M T::*member;
  const M& operator()(const Result<T>& result) const { return result.value.*member; }
};

template <class T, class M>
ValueMember<T, M> value_of(M T::*member) {
  return {member};
}

/// Number of members that pickling must keep; 0 for a class that is no plain struct.
template <class C>
constexpr std::size_t struct_size() {
  if constexpr (std::is_aggregate_v<C>)
    return internal::core::member_count<C>();
  else
    return 0;
}
template <class C>
inline constexpr std::size_t pickled_count = struct_size<C>();
template <class T>
inline constexpr std::size_t pickled_count<Result<T>> = struct_size<T>() + 2;

/// A py::class_ whose members, each bound by def_readonly or by def_property_readonly with
/// value_of, are also what pickling keeps. Pickling fails with TypeError when C has more members
/// than these.
template <class C, class... Extra>
class ResultClass : public py::class_<C, Extra...> {
 public:
  using Base = py::class_<C, Extra...>;

  template <class... Args>
  ResultClass(py::handle scope, const char* name, const Args&... args)
      : Base(scope, name, args...), members_(std::make_shared<std::vector<Bound>>()) {
    Base::def(py::pickle(
        [members = members_, name = std::string(name)](const C& object) {
          if (members->size() < pickled_count<C>)
            throw py::type_error(name + " cannot be pickled: " + std::to_string(members->size()) +
                                 " of its " + std::to_string(pickled_count<C>) +
                                 " members are bound");
          State state;
          for (const Bound& bound : *members) state[bound.name.c_str()] = bound.get(object);
          return state;
        },
        [members = members_](const State& state) {
          C object{};
          for (const Bound& bound : *members)
            if (state.contains(bound.name)) bound.set(object, state[bound.name.c_str()]);
          return object;
        }));
  }

  template <class T, class D, class... Args>
  ResultClass& def_readonly(const char* name, T D::*member, const Args&... args) {
    Base::def_readonly(name, member, args...);
    return pickled(name, member);
  }

  template <class Getter, class... Args>
  ResultClass& def_property_readonly(const char* name, const Getter& getter, const Args&... args) {
    Base::def_property_readonly(name, getter, args...);
    return *this;
  }

  template <class T, class M, class... Args>
  ResultClass& def_property_readonly(const char* name, const ValueMember<T, M>& getter,
                                     const Args&... args) {
    Base::def_property_readonly(name, getter, args...);
    return keep<M>(
        name, [getter](auto& result) -> auto& { return result.value.*getter.member; });
  }

  template <class... Args>
  ResultClass& def(Args&&... args) {
    Base::def(std::forward<Args>(args)...);
    return *this;
  }

  /// A member that is pickled and has no property of its name.
  template <class T, class D>
  ResultClass& pickled(const char* name, T D::*member) {
    return keep<T>(
        name, [member](auto& object) -> auto& { return object.*member; });
  }
  template <class T, class M>
  ResultClass& pickled(const char* name, const ValueMember<T, M>& value) {
    return keep<M>(
        name, [value](auto& result) -> auto& { return result.value.*value.member; });
  }

 private:
  struct Bound {
    std::string name;
    std::function<py::object(const C&)> get;
    std::function<void(C&, const py::object&)> set;
  };

  template <class T, class Access>
  ResultClass& keep(const char* name, const Access& access) {
    members_->push_back(
        {name,
         [access](const C& object) -> py::object {
           if constexpr (std::is_base_of_v<py::handle, T>) {
             return access(object);
           } else {
             return py::cast(access(object), py::return_value_policy::copy);
           }
         },
         [access](C& object, const py::object& value) { access(object) = value.cast<T>(); }});
    return *this;
  }

  std::shared_ptr<std::vector<Bound>> members_;
};

/// The properties that every Result<T> has.
template <class T>
void define_result(ResultClass<Result<T>>& cls) {
  using R = Result<T>;
  cls.def_property_readonly(
         "ok", [](const R& r) { return r.ok(); }, "Whether status is Status.ok.")
      .def_readonly("status", &R::status, "How it ended, a Status.")
      .def_readonly("message", &R::message, "One sentence; may be empty.");
}

}  // namespace occ::python
