"""Changes to materials that change nothing, because a model has no material of such a name."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from fnmatch import fnmatchcase

from viewsphere.assets.exporting.glb import material_names
from viewsphere.model.model_spec import ModelSpec
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.shots.stages import model_files
from viewsphere.store import Store

MOST_NAMES = 8
"""Materials that a warning lists."""


def unpainted(recipe: Recipe, specs: Sequence[ModelSpec], store: Store) -> dict[str, tuple[str, ...]]:
    """Warnings by the keys of finished models, for each change that is for them and fits none of their materials.

    One for all models (`models: '*'`) that fits some of them is meant so.
    """
    warnings: defaultdict[str, tuple[str, ...]] = defaultdict(tuple)
    for i, entry in enumerate(recipe.scene.materials):
        meant = [spec.key for spec in specs if fnmatchcase(spec.key, entry.models)]
        if entry.material == "*":
            continue
        files = {key: store.root / model_files(key)[1] for key in meant}
        names = {key: material_names(file) for key, file in files.items() if file.is_file()}
        missed = [key for key in names if not any(fnmatchcase(name, entry.material) for name in names[key])]
        if entry.models == "*" and len(missed) < len(names):
            continue
        for key in missed:
            known = sorted(filter(None, set(names[key])))
            listed = ", ".join(known[:MOST_NAMES]) + (", ..." if len(known) > MOST_NAMES else "")
            such = f"a pattern of its materials' names ({listed})" if known else "names of its materials, which have none,"
            text = f"expected {such}; found {entry.material!r}, which fits none: it changes nothing"
            warnings[key] += (recipe.locate(f"scene.materials[{i}].material: {text}"),)
    return dict(warnings)
