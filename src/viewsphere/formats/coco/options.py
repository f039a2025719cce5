"""The options of the format in recipes and on the command line."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from viewsphere.model.frozen import Frozen


class Options(Frozen):
    """The numbers of categories, the folders of pictures, and the encoding of masks."""

    category_ids: Literal["contiguous", "coco"] = Field(
        default="contiguous",
        description="`contiguous`: 1, 2, 3, ... in the data set's order of categories, as trainers expect; `coco`: COCO's own "
        "ids of its 80 names, however spelled (`hair_drier`, `hairdryer`), from 91 on for others; imported ones keep theirs",
    )
    pictures: Literal["images", "splits"] = Field(
        default="images",
        description="`images`: in `images/<split>/`, where datumaro looks; `splits`: in `<split>/`, as the paper's tool does",
    )

    segmentation: Literal["polygons", "rle"] = Field(
        default="polygons",
        description="of masks, both exact. `polygons`: rings along pixels' edges; `rle`: pycocotools' compressed run lengths",
    )

    def folder(self, split: str) -> str:
        """Return the folder of a split's pictures, relative to the export's folder."""
        return f"images/{split}" if self.pictures == "images" else split
