"""Digests made anew over what a test spoilt, so that the proofs of labels have to find what digests would."""

from pathlib import Path

from viewsphere.errors import StoreError
from viewsphere.store.shots.checksums import CHECKSUMS, write_checksums
from viewsphere.store.shots.manifest import MANIFEST, SHARD, Manifest, Span, digest


def seal_again(root: Path) -> None:
    """Let every folder of a data set that has a manifest have one of what lies there now, and every export its list."""
    for file in Path(root).glob(f"*/{CHECKSUMS}"):
        write_checksums(file.parent)
    for file in Path(root).glob(f"store/**/{MANIFEST}"):
        Manifest(Manifest.from_folder(file.parent).files, _spans(file)).write(file.parent)


def _spans(file: Path) -> dict[str, Span]:
    """Where files lie in the folder's tar, as its manifest says, with the digests of what lies there now."""
    try:
        known, data = Manifest.read(file.parent).spans, (file.parent / SHARD).read_bytes()
    except (StoreError, OSError):
        return {}
    return {path: (at, size, digest(data[at : at + size])) for path, (at, size, _) in known.items()}
