"""COLLADA files in the making, for tests of readers."""

import numpy as np

DOCUMENT = (
    '<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">'
    "<asset><up_axis>Z_UP</up_axis></asset><library_geometries>{geometries}</library_geometries>"
    '<library_visual_scenes><visual_scene id="s">{nodes}</visual_scene></library_visual_scenes>'
    '<scene><instance_visual_scene url="#s"/></scene></COLLADA>'
)


def source(name, rows, params="XYZ"):
    """A source of rows of numbers."""
    rows = np.asarray(rows, float)
    named = "".join(f'<param name="{p}" type="float"/>' for p in params)
    numbers = " ".join(repr(x) for x in rows.ravel().tolist())
    return (
        f'<source id="{name}"><float_array id="{name}-a" count="{rows.size}">{numbers}</float_array>'
        f'<technique_common><accessor source="#{name}-a" count="{len(rows)}" stride="{rows.shape[1]}">'
        f"{named}</accessor></technique_common></source>"
    )


def geometry(positions, faces, name="g", more=""):
    """A geometry with positions, of which `faces` is the element with its indices; `more` are further sources."""
    vertices = f'<vertices id="{name}-v"><input semantic="POSITION" source="#{name}-p"/></vertices>'
    return f'<geometry id="{name}"><mesh>{source(f"{name}-p", positions)}{more}{vertices}{faces}</mesh></geometry>'


def faces(tag, body, name="g", more=""):
    """An element of faces whose corners name vertices in column 0."""
    return f'<{tag} count="1"><input semantic="VERTEX" source="#{name}-v" offset="0"/>{more}{body}</{tag}>'


def p(indices, tag="p"):
    """A run of indices."""
    return f"<{tag}>{' '.join(map(str, indices))}</{tag}>"


def document(geometries, nodes='<node><instance_geometry url="#g"/></node>'):
    """A whole file."""
    return DOCUMENT.format(geometries=geometries, nodes=nodes)
