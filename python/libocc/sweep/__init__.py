# SPDX-License-Identifier: Apache-2.0
"""Sweeps: any parameters of a scene over ranges, from one file."""
