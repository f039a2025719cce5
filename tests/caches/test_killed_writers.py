"""Killed processes leave no torn entry in the cache, and nothing over its limit.

benchmarks/faults does the same with more processes.
"""

from __future__ import annotations

import sys

import pytest

from cache_kills import LIMIT, campaign
from viewsphere.kernels.entries import kernel_folder


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="forks, and /proc")
def test_fifty_killed_writers_of_all_kinds(tmp_path, monkeypatch):
    kernels = kernel_folder()
    monkeypatch.setenv("VIEWSPHERE_CACHE", str(tmp_path / "cache"))
    monkeypatch.setenv("VIEWSPHERE_CACHE_LIMIT", str(LIMIT))
    findings = campaign(tmp_path / "place", kernels, kills=50, seed=1)
    assert findings.is_good, findings
    assert findings.kills >= 50
    assert findings.seen_writing > 0
