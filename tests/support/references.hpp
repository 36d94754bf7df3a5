// SPDX-License-Identifier: Apache-2.0
// Compares results with those of an earlier version, which are files beside the tests. This shows
// that a change alters a result; whether results are right is checked elsewhere.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "libocc/geometry/rigid.hpp"

namespace occ::test {

/// Labelled results of one case.
class CaseResults {
 public:
  void add(const std::string& label, double value);
  void add(const std::string& label, const std::string& value);
  void add(const std::string& label, const char* value) { add(label, std::string(value)); }
  void add(const std::string& label, const std::vector<double>& values);
  void add(const std::string& label, const Eigen::Ref<const Eigen::MatrixXd>& values);
  void add(const std::string& label, const Rigid3& pose);

  /// Number, sum and a weighted sum of many values: shorter than all of them, and a change of any
  /// value alters it.
  void summarise(const std::string& label, const std::vector<double>& values);

  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

/// Results of many cases of one kind, kept in the file tests/NAME.reference.
class References {
 public:
  /// `name`: module and kind, as in "pose/robust_pose".
  explicit References(const std::string& name);

  void add(const std::string& name, const CaseResults& results);

  /// Cases that differ from the file, in words; empty if all agree to one in 10^6 (values below
  /// 10^-12 are equal). With the environment variable LIBOCC_WRITE_REFERENCES, writes the file.
  std::string differences() const;

 private:
  std::string path_;
  std::vector<std::string> lines_;
};

}  // namespace occ::test
