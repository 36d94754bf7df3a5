// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/internal/free_parameter.hpp"

#include <algorithm>

#include "libocc/camera/internal/parameter_values.hpp"
#include "libocc/core/require.hpp"

namespace occ {

using internal::network::parameter_columns;
using internal::network::ParameterColumns;

namespace {

std::string names_of(const std::vector<CameraParameter>& parameters) {
  std::string names;
  for (const CameraParameter& parameter : parameters)
    names += (names.empty() ? "" : ", ") + parameter.name;
  return names;
}

int column_named(const std::vector<CameraParameter>& parameters, const std::string& name) {
  const auto found =
      std::find_if(parameters.begin(), parameters.end(),
                   [&](const CameraParameter& parameter) { return parameter.name == name; });
  return found == parameters.end() ? -1 : static_cast<int>(found - parameters.begin());
}

ParameterColumns require_columns(const std::vector<CameraParameter>& parameters,
                                 const std::string& name) {
  const auto columns = parameter_columns(parameters, name);
  require(columns.has_value(), "name", name, "one of " + names_of(parameters) + ", f_px");
  return *columns;
}

}  // namespace

std::optional<ParameterColumns> internal::network::parameter_columns(
    const std::vector<CameraParameter>& parameters, const std::string& name) {
  if (name != common_focal_length) {
    const int column = column_named(parameters, name);
    if (column < 0) return std::nullopt;
    return ParameterColumns{column, -1};
  }
  const int fx = column_named(parameters, "fx_px"), fy = column_named(parameters, "fy_px");
  if (fx < 0 || fy < 0) return std::nullopt;
  return ParameterColumns{fx, fy};
}

CameraParameter free_parameter(const Camera& camera, const std::string& name) {
  const std::vector<CameraParameter> parameters = camera.parameters();
  CameraParameter found = parameters[require_columns(parameters, name).column];
  found.name = name;
  return found;
}

Camera with_free_parameter(const Camera& camera, const std::string& name, double value) {
  const ParameterColumns columns = require_columns(camera.parameters(), name);
  Eigen::VectorXd values = internal::camera::parameter_values(camera);
  if (columns.tied >= 0) values[columns.tied] *= value / values[columns.column];
  values[columns.column] = value;
  return camera.with_parameters(values);
}

Eigen::MatrixXd free_parameter_directions(const Camera& camera,
                                          const std::vector<std::string>& names) {
  const std::vector<CameraParameter> parameters = camera.parameters();
  Eigen::MatrixXd directions = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(parameters.size()),
                                                     static_cast<Eigen::Index>(names.size()));
  for (std::size_t k = 0; k < names.size(); ++k) {
    const ParameterColumns columns = require_columns(parameters, names[k]);
    const auto column = static_cast<Eigen::Index>(k);
    directions(columns.column, column) = 1;
    if (columns.tied >= 0)
      directions(columns.tied, column) =
          parameters[columns.tied].value / parameters[columns.column].value;
  }
  return directions;
}

}  // namespace occ
