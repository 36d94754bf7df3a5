# SPDX-License-Identifier: Apache-2.0
"""Parameter sweeps of `libocc sweep`."""
