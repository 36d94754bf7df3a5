# SPDX-License-Identifier: Apache-2.0
"""What accuracy costs in time: every way to a pose on the same simulated images."""
