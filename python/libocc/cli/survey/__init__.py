# SPDX-License-Identifier: Apache-2.0
"""Survey of a room from pictures: input, figure and files."""
