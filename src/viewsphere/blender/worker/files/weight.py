"""Estimates how many triangles modifiers will make, before Blender evaluates them."""

from __future__ import annotations


def check_weight(scene, wanted, most):
    """Raise ValueError if the objects to evaluate have more than `most` triangles in total."""
    total = 0
    for item in scene.objects:
        if item.hide_render or item.type != "MESH" or (wanted is not None and item.as_pointer() not in wanted):
            continue
        count, cause = _expected_triangles(item, scene.render)
        total += count
        if count > most:
            raise ValueError(
                f"object {item.name!r}: expected at most {most:,} triangles, found about {count:,} by its modifier {cause!r}; "
                "lower its levels or counts for rendering"
            )
    if total > most:
        raise ValueError(f"expected at most {most:,} triangles, found about {total:,} by modifiers; lower their levels")


def _expected_triangles(item, render):
    """The expected triangles of an object, and the modifier that makes the most of them; unknown modifiers count as none."""
    faces, loops = len(item.data.polygons), len(item.data.loops)
    cause, most = "", 1.0
    for modifier in item.modifiers:
        if not modifier.show_render:
            continue
        by = _factor(modifier, render, loops / max(faces, 1))
        if modifier.type in ("SUBSURF", "MULTIRES") and by > 1:
            faces, loops = faces * by, 4 * faces * by
        else:
            faces, loops = faces * by, loops * by
        if by > most:
            cause, most = modifier.name, by
    return int(max(loops - 2 * faces, 0)), cause


def _factor(modifier, render, corners):
    """The number of faces that a modifier makes from one face with this number of corners."""
    if modifier.type in ("SUBSURF", "MULTIRES"):
        levels = modifier.render_levels
        if render.use_simplify:
            levels = min(levels, render.simplify_subdivision_render)
        return corners * 4.0 ** (levels - 1) if levels else 1.0
    if modifier.type == "ARRAY" and modifier.fit_type == "FIXED_COUNT":
        return float(max(modifier.count, 1))
    if modifier.type == "MIRROR":
        return 2.0 ** sum(modifier.use_axis)
    if modifier.type == "SOLIDIFY":
        return 2.0
    if modifier.type == "SCREW":
        return float(max(modifier.render_steps * modifier.iterations, 1))
    return 1.0
