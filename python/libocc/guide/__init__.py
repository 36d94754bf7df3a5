# SPDX-License-Identifier: Apache-2.0
"""Experiments with a vehicle that is guided by its position fixes."""
