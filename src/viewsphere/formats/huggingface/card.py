"""The data set's card: YAML (https://huggingface.co/docs/hub/datasets-manual-configuration) and Markdown."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from viewsphere.formats.huggingface.shards import Shards
from viewsphere.store import Dataset
from viewsphere.store.credits import credits_text, escaped

CARD = "README.md"


def card(dataset: Dataset, shards: Shards) -> str:
    """The text of the card: the files of each split, the columns, and the credits."""
    files = "".join(f"  - split: {s.name}\n    path: data/{s.name}-*.parquet\n" for s in shards.splits.values())
    head = f"---\npretty_name: {json.dumps(dataset.name)}\nconfigs:\n- config_name: default\n  data_files:\n{files}---\n"
    columns = "".join(f"| `{name}` | {_told(feature)} |\n" for name, feature in shards.columns.features.items())
    text = f"\n# {escaped(dataset.name)}\n\nMade by viewsphere {dataset.plan.version}.\n\n"
    table = f"| column | type |\n|---|---|\n{columns}"
    credits = credits_text(dataset.models)
    return head + text + table + (f"\n{credits.replace('# ', '## ', 1)}" if credits else "")


def _told(feature: Mapping[str, Any]) -> str:
    match feature.get("_type"):
        case "Image" | "ClassLabel" as kind:
            return kind
        case "Value":
            return feature["dtype"]
        case "Sequence":
            length = f" of {feature['length']}" if feature["length"] >= 0 else ""
            return f"list{length}: {_told(feature['feature'])}"
        case _:
            return "; ".join(f"`{name}`: {_told(inner)}" for name, inner in feature.items())
