# SPDX-License-Identifier: Apache-2.0
"""Catalogue, reference solutions and verdicts of `libocc hard-cases`."""
