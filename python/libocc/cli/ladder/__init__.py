# SPDX-License-Identifier: Apache-2.0
"""Accuracy against time for `libocc ladder`: all methods on the same simulated images."""
