"""A test's own cache."""

from __future__ import annotations

from viewsphere.kernels.entries import kernel_folder


def scratch_cache(monkeypatch, folder) -> None:
    """Let this folder be the cache. Compiled kernels stay where they are: to compile a picture's takes half a minute."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(kernel_folder()))
    monkeypatch.setenv("VIEWSPHERE_CACHE", str(folder))
