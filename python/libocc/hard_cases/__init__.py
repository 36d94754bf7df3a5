# SPDX-License-Identifier: Apache-2.0
"""Problems that break pose solvers, and who solves them: what `libocc hard-cases` prints."""
