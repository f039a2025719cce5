"""Pictures, which become models: an upright plane that shows the picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

from viewsphere.plugins.reader import ReaderSpec

if TYPE_CHECKING:
    from viewsphere.assets.mesh import Mesh
    from viewsphere.assets.paths.folder import ModelFolder
    from viewsphere.assets.primitive import FileFacts


def _read(folder: ModelFolder) -> tuple[Mesh, FileFacts]:
    """A rectangle in the XZ plane that faces -Y, stands on z = 0 with its centre at x = 0, is 1 unit high and has the picture's
    proportions.

    A picture of more than `SHARPEST` texels a side is reduced by a whole factor. Its back shows the picture mirrored. A
    photograph is rotated by its EXIF orientation. Clear texels cut holes (MASK) or, if many texels are partly clear, blend
    (BLEND), as `alpha.with_alpha_modes` decides. Raises ModelError if the file is not a picture or exceeds `limits`.
    """
    import numpy as np

    from viewsphere.assets.appearance.alpha import with_alpha_modes
    from viewsphere.assets.mesh import Image, Material, Texture
    from viewsphere.assets.paths.folder import SHARPEST, UnreadableError, decode_image, reduced
    from viewsphere.assets.primitive import FileFacts, Primitive, assemble

    data = folder.read_model()
    try:
        pixels = decode_image(data, str(folder.model), upright=True)
    except UnreadableError as error:
        raise folder.error(str(error).removeprefix(str(folder.model)).lstrip(": ")) from None
    if not pixels[..., 3].any():
        raise folder.error("expected a picture with something to see, found one that is clear all over")
    height, width = pixels.shape[:2]
    half = width / height / 2
    name = folder.model.stem
    plane = Primitive(
        part=name,
        material=0,
        positions=np.array([[-half, 0.0, 0.0], [half, 0.0, 0.0], [half, 0.0, 1.0], [-half, 0.0, 1.0]]),
        triangles=np.array([[0, 1, 2], [0, 2, 3]]),
        normals=np.tile([0.0, -1.0, 0.0], (4, 1)),
        uv0=np.array([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]),
    )
    texture = Texture(folder.add_image(Image(name, reduced(pixels, SHARPEST))), wrap_s="clamp", wrap_t="clamp")
    materials = with_alpha_modes(folder, [plane], [Material(name=name, base_color_texture=texture)], stated={0})
    facts = FileFacts(folder.model, folder.model.suffix[1:].lower(), "+z", "-y", 1.0)
    return assemble(folder, [plane], materials, facts)


READER = ReaderSpec(
    about="PNG, JPEG, WebP, BMP, TIFF",
    suffixes=("bmp", "jpeg", "jpg", "png", "tif", "tiff", "webp"),
    axes=("+z", "-y"),
    unit="1 m",
    is_picture=True,
    read=_read,
    modules=("viewsphere.assets.appearance.alpha", "viewsphere.assets.primitive"),
)
