// SPDX-License-Identifier: Apache-2.0
// Result structs in Python: read-only properties and pickling. A Result<T> becomes one flat object
// with the status, the message and the fields of the value.
#pragma once

#include "fields.hpp"
#include "libocc/core/status.hpp"
#include "members.hpp"

namespace occ::python {

/// A py::class_ of a result. It has no constructor in Python and can be pickled (members.hpp).
template <class C, class... Extra>
class ResultClass : public py::class_<C, Extra...> {
 public:
  template <class... Args>
  ResultClass(py::handle scope, const char* name, const Args&... args)
      : py::class_<C, Extra...>(scope, name, args...) {
    this->def(py::pickle([](const C& object) { return packed(object); },
                         [](const py::object& state) { return unpacked<C>(state); }));
  }
};

/// Getter of a member of the value inside a result.
template <class T, class M>
auto value_of(M T::*member) {
  return [member](const Result<T>& result) -> const M& { return result.value.*member; };
}

/// The properties that every Result<T> has.
template <class T>
void define_result(py::class_<Result<T>>& cls) {
  cls.def_property_readonly(
         "ok", [](const Result<T>& r) { return r.ok(); }, "True if status is Status.ok.")
      .def_readonly("status", &Result<T>::status, "Status: ok, or the kind of failure.")
      .def_readonly("message", &Result<T>::message, "A sentence for the user; may be empty.");
}

}  // namespace occ::python
