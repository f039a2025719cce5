"""Channels that no format of a run uses but that take much disk space."""

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
"""Share of the frames' bytes from which channels that no format uses are reported."""

WORTH_NAMING = 0.05
"""Share of the frames' bytes from which a single channel is named."""

MOST_SHOTS = 100
"""Maximum number of shots whose files are added up."""


@dataclass(frozen=True)
class Unused:
    """Channels that none of the formats uses, largest first, and their share of the bytes of all channels."""

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
    """The channels of finished shots that none of these formats uses; None if they take little space, or without formats."""
    entries = tuple(formats)
    return among(_channel_bytes(store), entries) if entries else None


def among(sizes: Counter[str], formats: Sequence[FormatEntry]) -> Unused | None:
    """The channels that none of these formats uses, given the bytes of each channel; None if they take little space."""
    total = sizes.total()
    left = [name for name, size in sizes.most_common() if size >= WORTH_NAMING * total and not _is_used(name, formats)]
    share = sum(sizes[name] for name in left) / total if total else 0.0
    return Unused(tuple(left), share, tuple(dict.fromkeys(entry.name for entry in formats))) if share >= LARGE else None


def _channel_bytes(store: Store) -> Counter[str]:
    """Bytes of each channel in some of the finished shots, from their manifests, without damaged shots."""
    sizes: Counter[str] = Counter()
    for key in islice(store.finished(), MOST_SHOTS):
        with suppress(StoreError):  # `check` reports damage
            for path, (size, _) in Manifest.read(store.shot_folder(key)).seals.items():
                sizes[path.rpartition("/")[0]] += size
    del sizes[""]  # records are not a channel
    return sizes


def _is_used(channel: str, formats: Iterable[FormatEntry]) -> bool:
    """Return whether a channel is a picture or one of the formats needs it. A format that does not declare its needs takes all
    channels.
    """
    specs = ((plugins.load(FormatSpec, entry.name), entry) for entry in formats)
    names = {channel, "depth"} if channel == "depth_ray" else {channel}  # which takes the place of depth in panoramas
    return channel in PICTURES or any(spec.channels is None or names & {*needs_of(spec, entry)} for spec, entry in specs)
