// SPDX-License-Identifier: Apache-2.0
// Decodes an id from samples of a lamp's light, by maximum likelihood over the phase and the clock
// error of the lamp. For each, the patterns of every slot are compared with the samples inside it,
//
//   log L = - sum over samples (value - offset - gain pattern)^2 / (2 sigma^2),
//
// summed over all repeats of a symbol before the decision (soft decision). The patterns are blurred
// by the exposure. Offset and gain (csk: the crosstalk matrix) are estimated from the decisions,
// and the symbols are decided again (decision feedback).
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
  double start_s = 0;     ///< begin of the exposure, on the camera's clock
  double exposure_s = 0;  ///< duration; equal for all samples of a lamp
  double value = 0;       ///< about 0 when dark, 1 when lit
  double sigma = 0;       ///< standard deviation of `value`, positive
  int channel = 0;        ///< see Waveform
  int frame = 0;          ///< index of its image
};

/// Outcome of decoding.
enum class CodeStatus {
  ok,               ///< the checksum is correct and few bit errors are expected
  no_signal,        ///< the samples do not contain such a code
  incomplete,       ///< no sample covers some parts of the packet
  uncertain,        ///< too many bit errors are expected, or the phase is ambiguous
  checksum_failed,  ///< the decided bits have a wrong checksum
};

/// The enumerator's name, e.g. "checksum_failed".
LIBOCC_API const char* to_string(CodeStatus status);

/// Decoded id, or the reason why there is none.
struct DecodedCode {
  CodeStatus status = CodeStatus::no_signal;  ///< `id` is set only with ok
  std::string message;                        ///< one sentence; empty when ok
  std::optional<std::uint32_t> id;            ///< only when ok
  Bits bits;                                  ///< decided bits: id and checksum
  std::vector<double> margins;  ///< log likelihood ratio of each bit against its opposite
  double expected_errors = 0;   ///< expected number of wrong bits, from the margins
  double explained = 0;  ///< part of the variance beyond noise that the transmitted light explains
  double clock_error = 0;  ///< relative clock error of the lamp; 0 if it is not estimated
  int frames = 0;          ///< number of frames with samples

  /// True if an id was decoded.
  bool ok() const { return status == CodeStatus::ok; }
};

/// Options of decode_samples().
struct LIBOCC_API DecodeSamplesOptions {
  double max_clock_error = 1.5e-4;    ///< search range: relative clock error of lamp against camera
  double max_expected_errors = 0.05;  ///< more expected bit errors give status `uncertain`
  /// c_ook: true if time stamps are accurate to a quarter of a chip. The samples of all frames are
  /// then decoded together; else the bit likelihoods of single frames are combined.
  bool exact_times = false;
  /// Known start time of a period, for measuring error rates; the clock error is then zero.
  std::optional<double> period_start_s;

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Decodes samples in any order, all with the same exposure. An id is returned only if its checksum
/// is correct. Throws std::invalid_argument for a sample that is not finite, whose sigma or
/// exposure is not positive, or whose channel the code does not have.
LIBOCC_API DecodedCode decode_samples(const std::vector<LightSample>& samples, const Code& code,
                                      const DecodeSamplesOptions& options = {});

}  // namespace occ
