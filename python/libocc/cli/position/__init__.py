# SPDX-License-Identifier: Apache-2.0
"""Live positioning for `libocc position`: records of each frame and the outputs that receive them."""
