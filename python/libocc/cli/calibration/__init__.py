# SPDX-License-Identifier: Apache-2.0
"""Runs, figures, reports and JSON of `libocc calibrate` and `libocc measure`."""
