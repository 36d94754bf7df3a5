# SPDX-License-Identifier: Apache-2.0
"""Networks of images for bundle adjustment, and their files."""

from .files import network_files, read_network

__all__ = ["network_files", "read_network"]
