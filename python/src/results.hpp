// SPDX-License-Identifier: Apache-2.0
// A Result<T> is one flat object in Python: its status beside its value's fields.
#pragma once

#include <pybind11/native_enum.h>
#include <pybind11/pybind11.h>

#include <string>

#include "libocc/core/status.hpp"

namespace occ::python {

template <class T>
void define_result(pybind11::class_<Result<T>>& cls) {
  cls.def_property_readonly(
         "ok", [](const Result<T>& r) { return r.ok(); }, "Whether status is Status.ok.")
      .def_property_readonly(
          "status", [](const Result<T>& r) { return r.status; }, "How it ended, a Status.")
      .def_property_readonly(
          "message", [](const Result<T>& r) { return r.message; }, "A sentence, may be empty.");
}

/// A property of the value inside a result.
template <class T, class M>
auto value_of(M T::*member) {
  return [member](const Result<T>& r) -> const M& { return r.value.*member; };
}

}  // namespace occ::python
