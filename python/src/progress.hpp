// SPDX-License-Identifier: Apache-2.0
// Progress callbacks in Python, called without the global interpreter lock.
#pragma once

#include <pybind11/pybind11.h>

namespace occ::python {

namespace py = pybind11;

/// Raises the signals of Python, such as Ctrl-C, and calls progress(values...) if it is not None.
/// False stops: only if the callback returns that.
template <class... Values>
bool report_progress(const py::object& progress, const Values&... values) {
  py::gil_scoped_acquire locked;
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  if (progress.is_none()) return true;
  const py::object answer = progress(values...);
  return answer.is_none() || answer.cast<bool>();
}

}  // namespace occ::python
