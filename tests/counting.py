"""What functions are called with."""

from __future__ import annotations

from viewsphere.plugins.spec import Spec


def counted(monkeypatch, owner, name):
    """What a function was called with since."""
    calls, own = [], getattr(owner, name)

    def told(*args, **options):
        calls.append(args)
        return own(*args, **options)

    if isinstance(owner, Spec):  # frozen
        monkeypatch.setitem(vars(owner), name, told)
    else:
        monkeypatch.setattr(owner, name, told)
    return calls
