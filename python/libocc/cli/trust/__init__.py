# SPDX-License-Identifier: Apache-2.0
"""Reliability of verdicts for `libocc trust`: families of problems with known truth, risk against errors."""
