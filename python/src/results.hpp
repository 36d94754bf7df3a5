// SPDX-License-Identifier: Apache-2.0
// Result structs in Python: read-only properties and pickling. A Result<T> becomes one flat object
// with the status, the message and the fields of the value.
#pragma once

#include "fields.hpp"
#include "libocc/core/status.hpp"
#include "members.hpp"

namespace occ::python {

/// A member of the value inside a result.
template <class T, class M>
struct ValueMember {
  M T::*member;
  const M& operator()(const Result<T>& result) const { return result.value.*member; }
};

template <class T, class M>
ValueMember<T, M> value_of(M T::*member) {
  return {member};
}

/// A py::class_ of a result. It has no constructor in Python and can be pickled (members.hpp).
/// Properties that are members do not instantiate pybind11's templates.
template <class C, class... Extra>
class ResultClass : public py::class_<C, Extra...> {
 public:
  using py::class_<C, Extra...>::def_property_readonly;

  template <class... Args>
  ResultClass(py::handle scope, const char* name, const Args&... args)
      : py::class_<C, Extra...>(scope, name, args...) {
    const auto get = [](const void* object) { return packed(*static_cast<const C*>(object)); };
    const auto set = [](const py::object& state) {
      return ClassTable::Object(new C(unpacked<C>(state)), &ClassTableOf<C>::destroy);
    };
    define_pickling(*this, {&typeid(C), &ConversionsOf<py::object>::to_python, get, set});
  }

  template <class D, class M>
  ResultClass& def_readonly(const char* name, M D::*member, const char* doc) {
    const auto access = [member](const C& object) -> const M& { return object.*member; };
    return def_member<M>(name, access, doc);
  }

  template <class T, class M>
  ResultClass& def_property_readonly(const char* name, const ValueMember<T, M>& member,
                                     const char* doc) {
    return def_member<M>(name, member, doc);
  }

 private:
  template <class M, class Access>
  ResultClass& def_member(const char* name, const Access& access, const char* doc) {
    define_property(*this, typeid(C),
                    {name, doc, false, offset_of<C>(access), &ConversionsOf<M>::to_python});
    return *this;
  }
};

/// The properties that every Result<T> has.
template <class T>
void define_result(py::class_<Result<T>>& cls) {
  cls.def_property_readonly(
         "ok", [](const Result<T>& r) { return r.ok(); }, "True if status is Status.ok.")
      .def_readonly("status", &Result<T>::status, "Status: ok, or the kind of failure.")
      .def_readonly("message", &Result<T>::message, "A sentence for the user; may be empty.");
}

}  // namespace occ::python
