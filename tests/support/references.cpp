// SPDX-License-Identifier: Apache-2.0
#include "tests/support/references.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace occ::test {
namespace {

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.10g", value);
  return text;
}

bool agree(const std::string& first, const std::string& second) {
  if (first == second) return true;
  char* first_end = nullptr;
  char* second_end = nullptr;
  const double a = std::strtod(first.c_str(), &first_end);
  const double b = std::strtod(second.c_str(), &second_end);
  if (*first_end != '\0' || *second_end != '\0') return false;
  return std::abs(a - b) <= 1e-12 + 1e-6 * std::max(std::abs(a), std::abs(b));
}

std::vector<std::string> words_of(const std::string& line) {
  std::istringstream stream(line);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

// Difference of two lines, with the last label before it; empty if they agree.
std::string difference(const std::string& expected, const std::string& actual) {
  const std::vector<std::string> before = words_of(expected);
  const std::vector<std::string> now = words_of(actual);
  std::string label;
  for (std::size_t i = 0; i < std::max(before.size(), now.size()); ++i) {
    const std::string old_word = i < before.size() ? before[i] : "nothing";
    const std::string new_word = i < now.size() ? now[i] : "nothing";
    if (!agree(old_word, new_word)) return label + " " + new_word + " instead of " + old_word;
    if (old_word.back() == ':') label = old_word;
  }
  return "";
}

}  // namespace

void CaseResults::add(const std::string& label, const std::string& value) {
  text_ += " " + label + ": " + value;
}

void CaseResults::add(const std::string& label, double value) { add(label, number(value)); }

void CaseResults::add(const std::string& label, const std::vector<double>& values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : " ") + number(value);
  add(label, text.empty() ? "none" : text);
}

void CaseResults::add(const std::string& label, const Eigen::Ref<const Eigen::MatrixXd>& values) {
  std::vector<double> list;
  for (const double value : values.reshaped()) list.push_back(value);
  add(label, list);
}

void CaseResults::add(const std::string& label, const Rigid3& pose) {
  add(label, Eigen::MatrixXd(pose.rotation));
  add("translation", Eigen::MatrixXd(pose.translation));
}

void CaseResults::summarise(const std::string& label, const std::vector<double>& values) {
  double sum = 0, weighted = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    sum += values[i];
    weighted += values[i] * (1 + std::cos(static_cast<double>(i)));
  }
  add(label, std::vector<double>{static_cast<double>(values.size()), sum, weighted});
}

References::References(const std::string& name) : path_(LIBOCC_TESTS "/" + name + ".reference") {}

void References::add(const std::string& name, const CaseResults& results) {
  lines_.push_back(name + " |" + results.text());
}

std::string References::differences() const {
  if (std::getenv("LIBOCC_WRITE_REFERENCES") != nullptr) {
    std::ofstream file(path_);
    for (const std::string& line : lines_) file << line << '\n';
    if (!file.flush()) throw std::runtime_error(path_ + ": cannot be written");
    return "";
  }
  std::ifstream file(path_);
  std::vector<std::string> expected;
  for (std::string line; std::getline(file, line);) expected.push_back(line);
  if (expected.empty()) return path_ + ": missing or empty";
  std::string text;
  for (std::size_t i = 0; i < std::max(expected.size(), lines_.size()); ++i) {
    const std::string before = i < expected.size() ? expected[i] : "no case";
    const std::string now = i < lines_.size() ? lines_[i] : "no case";
    const std::string found = difference(before, now);
    if (!found.empty()) text += now.substr(0, now.find(" |")) + ": " + found + "\n";
  }
  return text;
}

}  // namespace occ::test
