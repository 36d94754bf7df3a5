# SPDX-License-Identifier: Apache-2.0
"""Experiments with a vehicle that drives by its lamps: files, runs, tests, pictures."""
