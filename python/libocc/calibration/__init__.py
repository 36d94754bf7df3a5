# SPDX-License-Identifier: Apache-2.0
"""Networks as files, and what a calibration tells: figures, report, JSON."""
