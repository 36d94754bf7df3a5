# SPDX-License-Identifier: Apache-2.0
import time

from libocc.cli import progress as module


def test_progress_shows_only_in_a_long_run(monkeypatch, capsys):
    for quiet, shown in ((1e9, False), (-1.0, True)):
        monkeypatch.setattr(module, "QUIET_S", quiet)
        monkeypatch.setenv("FORCE_COLOR", "1")  # treated as a terminal
        with module.progress("solving", 3) as advance:
            advance()
            advance()
        assert ("solving" in capsys.readouterr().err) == shown


def test_progress_shows_during_a_long_first_step(monkeypatch, capsys):
    monkeypatch.setattr(module, "QUIET_S", 0.05)
    monkeypatch.setenv("FORCE_COLOR", "1")
    with module.progress("solving", 3):
        time.sleep(0.5)
    assert "solving" in capsys.readouterr().err
