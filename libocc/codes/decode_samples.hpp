// SPDX-License-Identifier: Apache-2.0
// Reads an id from samples of a lamp's light. Maximum likelihood over the phase and the clock error
// of the lamp: for each, every slot's patterns are compared with the samples that fall into it,
//
//   log L = - sum over samples (value - offset - gain pattern)^2 / (2 sigma^2),
//
// summed over all repeats of a symbol before it is decided (a soft majority). Exposure blurs the
// patterns as it blurs the light. Offset and gain (csk: the matrix of crosstalk) are learnt from
// what was decided, and all is decided again.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "libocc/codes/code.hpp"
#include "libocc/core/abi.hpp"

namespace occ {

/// Mean light over one exposure.
struct LightSample {
  double start_s = 0;
  double exposure_s = 0;
  double value = 0;  ///< about 0 when dark, 1 when lit
  double sigma = 0;  ///< its standard deviation, positive
  int channel = 0;   ///< see Waveform
  int frame = 0;     ///< which image it is of
};

enum class CodeStatus {
  ok,
  no_signal,        ///< the samples show no such code
  incomplete,       ///< parts of the packet were never seen
  uncertain,        ///< some bits are as likely wrong as right
  checksum_failed,  ///< bits that look good make no id
};

LIBOCC_API const char* to_string(CodeStatus status);

struct DecodedCode {
  CodeStatus status = CodeStatus::no_signal;
  std::string message;              ///< one sentence
  std::optional<std::uint32_t> id;  ///< only when ok
  Bits bits;                        ///< as decided: id and checksum
  std::vector<double> margins;      ///< log likelihood of each bit over that of its opposite
  double expected_errors = 0;       ///< wrong bits to be expected, from the margins
  double explained = 0;    ///< part of the variance beyond noise that the light sent explains
  double clock_error = 0;  ///< of the lamp, relative; 0 where it makes no difference
  int frames = 0;          ///< that had samples

  bool ok() const { return status == CodeStatus::ok; }
};

struct LIBOCC_API DecodeSamplesOptions {
  double max_clock_error = 1.5e-4;  ///< of lamp against camera, relative
  double max_expected_errors = 0.05;
  /// c_ook: whether time stamps are good to a quarter of a chip, so that frames may be joined
  /// before anything is decided. Else each frame is decided by itself, and what they say is joined.
  bool exact_times = false;
  /// Known time at which a period begins, for measuring error rates; no clock error then.
  std::optional<double> period_start_s;

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Samples in any order, all of one exposure. Never an id whose checksum does not hold. Throws
/// std::invalid_argument when a sample is not finite, has no positive sigma or exposure, or a
/// channel that the code has not.
LIBOCC_API DecodedCode decode_samples(const std::vector<LightSample>& samples, const Code& code,
                                      const DecodeSamplesOptions& options = {});

}  // namespace occ
