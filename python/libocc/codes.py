# SPDX-License-Identifier: Apache-2.0
"""Lamp identifiers in blinking light: channel codes, encoding and decoding."""

from ._core import (
    Checksum,
    Code,
    CodeBudget,
    CodeKind,
    CodeStatus,
    Decoded,
    DecodedCode,
    DecodedLamp,
    LampCode,
    LineCode,
    Waveform,
    code_budget,
    decode,
    decode_samples,
    encode_id,
)

__all__ = [
    "Checksum", "Code", "CodeBudget", "CodeKind", "CodeStatus", "Decoded", "DecodedCode", "DecodedLamp", "LampCode",
    "LineCode", "Waveform", "code_budget", "decode", "decode_samples", "encode_id",
]
