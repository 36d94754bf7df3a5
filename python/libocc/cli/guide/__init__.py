# SPDX-License-Identifier: Apache-2.0
"""Runs, summaries and pictures of `libocc guide`."""
