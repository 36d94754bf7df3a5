// SPDX-License-Identifier: Apache-2.0
#include "members.hpp"

namespace occ::python {

py::object list_of(const Objects& items) {
  py::list list(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) list[i] = items[i];
  return list;
}

py::object tuple_of(const Objects& items) {
  py::tuple tuple(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) tuple[i] = items[i];
  return tuple;
}

Objects elements_of(const py::object& sequence) {
  Objects elements;
  for (const py::handle item : sequence)
    elements.push_back(py::reinterpret_borrow<py::object>(item));
  return elements;
}

Objects members_of(const py::object& state, std::size_t count, const std::type_info& type) {
  Objects members = elements_of(state);
  if (members.size() == count) return members;
  std::string name = type.name();
  py::detail::clean_type_id(name);
  throw py::value_error("a pickled " + name + " must have " + std::to_string(count) +
                        " members, got " + std::to_string(members.size()));
}

}  // namespace occ::python
