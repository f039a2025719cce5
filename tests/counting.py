"""What functions are called with."""

from __future__ import annotations


def counted(monkeypatch, owner, name):
    """What a function was called with since."""
    calls, own = [], getattr(owner, name)

    def told(*args, **options):
        calls.append(args)
        return own(*args, **options)

    monkeypatch.setattr(owner, name, told)
    return calls
