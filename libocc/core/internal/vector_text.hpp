// SPDX-License-Identifier: Apache-2.0
// A vector in a message: "[0.6, 0, 3]".
#pragma once

#include <Eigen/Core>
#include <sstream>
#include <string>

namespace occ::internal::core {

template <typename Vector>
std::string vector_text(const Vector& vector) {
  static const Eigen::IOFormat format(Eigen::StreamPrecision, Eigen::DontAlignCols, ", ", ", ", "",
                                      "", "[", "]");
  std::ostringstream text;
  text << vector.transpose().format(format);
  return text.str();
}

}  // namespace occ::internal::core
