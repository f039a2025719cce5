"""Channels that take much of the disk, and that no format of a run uses."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice

from viewsphere import plugins
from viewsphere.errors import StoreError
from viewsphere.model.channel import PICTURES
from viewsphere.plugins.format import FormatSpec
from viewsphere.recipe.formats import FormatEntry
from viewsphere.run.exports.scope import needs_of
from viewsphere.store import Store
from viewsphere.store.shots.manifest import Manifest

LARGE = 0.5
"""From this share of the frames' bytes on, channels that no format uses are told."""

WORTH_NAMING = 0.05
"""Of the frames' bytes: what a channel takes that is worth to be left out."""

MOST_SHOTS = 100
"""Shots whose files are added up."""


@dataclass(frozen=True)
class Unused:
    """Channels, the largest first, that none of the formats uses, and their share of the bytes of all channels."""

    channels: tuple[str, ...]
    share: float
    formats: tuple[str, ...]

    def __str__(self) -> str:
        some = " and ".join(filter(None, (", ".join(self.channels[:-1]), self.channels[-1])))
        verb, them = ("are", "them") if len(self.channels) > 1 else ("is", "it")
        return (
            f"{some} {verb} {self.share:.0%} of the frames' bytes and no format uses {them} ({', '.join(self.formats)}): "
            f"leave {them} out of channels, unless you read {them} yourself"
        )


def unused(store: Store, formats: Iterable[FormatEntry]) -> Unused | None:
    """The channels of finished shots that none of these formats uses; None where these take little, or there is no format."""
    entries = tuple(formats)
    return among(channel_bytes(store), entries) if entries else None


def among(sizes: Counter[str], formats: Sequence[FormatEntry]) -> Unused | None:
    """The channels that none of these formats uses, of channels of so many bytes; None where these take little."""
    total = sizes.total()
    left = [name for name, size in sizes.most_common() if size >= WORTH_NAMING * total and not _is_used(name, formats)]
    share = sum(sizes[name] for name in left) / total if total else 0.0
    return Unused(tuple(left), share, tuple(dict.fromkeys(entry.name for entry in formats))) if share >= LARGE else None


def channel_bytes(store: Store) -> Counter[str]:
    """Bytes of each channel in some of the finished shots, as their manifests say; what is damaged is left out."""
    sizes: Counter[str] = Counter()
    for key in islice(store.finished(), MOST_SHOTS):
        with suppress(StoreError):  # `check` is what tells of damage
            for path, (size, _) in Manifest.read(store.shot_folder(key)).seals.items():
                sizes[path.rpartition("/")[0]] += size
    del sizes[""]  # records are no channel
    return sizes


def _is_used(channel: str, formats: Iterable[FormatEntry]) -> bool:
    """Return whether it is a picture, or one of the formats needs it, or does not say what it needs: such a format takes
    all.
    """
    specs = ((plugins.load(FormatSpec, entry.name), entry) for entry in formats)
    return channel in PICTURES or any(spec.channels is None or channel in needs_of(spec, entry) for spec, entry in specs)
