"""A detector is trained from scratch on rendered pictures, and judged on models it never saw: the more pictures, the better.

    pip install viewsphere torch torchvision
    python examples/detection.py OUT [--sizes 100 300 1000] [--steps 1500]

1. Cars, chairs, bicycles and boats of the zoo are rendered in random scenes. One in five models is held out, and the scenes of
   these are the test: no picture to train on shows any of them.
2. torchvision's FCOS, with random weights, is trained on the first 100, 300 and 1,000 pictures, for equally many steps: only
   the pictures differ.
3. pycocotools judges each on the same test pictures.

Everything is read from the export in COCO's format. A CPU is enough.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import itertools
import json
import math
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import torch
from PIL import Image
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval
from torchvision.models.detection import FCOS
from torchvision.models.detection.anchor_utils import AnchorGenerator
from torchvision.models.detection.backbone_utils import BackboneWithFPN
from torchvision.models.detection.fcos import FCOSHead
from torchvision.models.resnet import BasicBlock, ResNet
from torchvision.transforms import v2
from torchvision.tv_tensors import BoundingBoxes

import viewsphere as vs

SIZE = (160, 120)
FAMILIES = {"car": {"scale": {"length": 1.8}}, "chair": {}, "bicycle": {}, "boat": {"scale": {"length": 1.8}}}
"""The zoo's families, and the size of those that are larger than the others."""

VIEWS = 4
"""Pictures of each scene."""

HELD_OUT = 0.2
"""Share of the models that are in no picture to train on."""

SPARE = 1.1
"""Scenes to render for each that is wanted: by how many of them the held-out models stand in, chance decides."""

BLOCKS, WIDTHS, CHANNELS, CONVOLUTIONS = (1, 1, 1, 1), (128, 256, 512), 128, 2
"""Of the network: residual blocks of each stage, channels of the three last ones, channels and convolutions of the head."""

LEAST_SCORE = 0.05
"""What is found with less is left out."""

BATCH, RATE, DECAY, WARM_UP, LARGEST_GRADIENT = 16, 1e-3, 0.05, 0.1, 5.0
"""Pictures in a step, its highest rate, weight decay, share of the steps before that rate, and where gradients are clipped."""


def recipe(pictures: int, models: int) -> vs.Recipe:
    """Random scenes, so many that there are `pictures` to train on, of `models` of each family."""
    grounds = ["#3a3a36", "#6b6b68", "#8a8378", "#a39a8a", "#c8c0b0", "#5d6b45", "#7d6a52"]
    return vs.Recipe.model_validate(
        {
            "name": "detection",
            "seed": 1,
            "models": [{"source": f"zoo:{name}", "count": models, **options} for name, options in FAMILIES.items()],
            "scenes": {"count": math.ceil(SPARE * pictures / VIEWS / (1 - HELD_OUT)), "objects": [1, 4], "balance": "category"},
            "viewpoints": {"kind": "sphere", "count": VIEWS, "elevation": [5, 45], "distance": {"fill": [0.5, 1.1]}},
            "camera": {"size": list(SIZE), "fov_deg": 50},
            "scene": {
                "ground": {"color": {"choice": grounds}},
                "sun": {"azimuth": [0, 360], "elevation": [20, 70]},
                "sky": {"daylight": {"turbidity": [2, 6]}},
                "view": {"exposure": [-0.5, 0.5]},
            },
            "keep_annotations_above": 0.1,
            "channels": ["rgb", "instances"],
            "formats": ["coco"],
            "splits": {"by": "model", "train": 1 - HELD_OUT, "test": HELD_OUT},
        }
    )


def labelled(coco: Path, split: str) -> COCO:
    """The annotations of a split."""
    with contextlib.redirect_stdout(io.StringIO()):
        return COCO(coco / "annotations" / f"instances_{split}.json")


def pictures(coco: Path, split: str, labels: COCO) -> list[torch.Tensor]:
    """The pictures of a split in the order of their numbers, each (3, height, width) uint8."""
    files = [coco / "images" / split / labels.imgs[number]["file_name"] for number in sorted(labels.imgs)]
    return [torch.from_numpy(np.array(Image.open(file).convert("RGB"))).permute(2, 0, 1) for file in files]


def targets(labels: COCO) -> list[dict[str, torch.Tensor]]:
    """What torchvision's detectors learn from, of each picture: boxes (N, 4) of x0, y0, x1, y1 in pixels, labels (N,)."""
    found = []
    for number in sorted(labels.imgs):
        own = labels.imgToAnns[number]
        boxes = torch.tensor([a["bbox"] for a in own], dtype=torch.float32).reshape(-1, 4)
        boxes[:, 2:] += boxes[:, :2]
        found.append(
            {
                "boxes": BoundingBoxes(boxes, format="XYXY", canvas_size=SIZE[::-1]),
                "labels": torch.tensor([a["category_id"] for a in own], dtype=torch.int64),
            }
        )
    return found


def models_in(labels: COCO) -> list[str]:
    """Keys of the models that are labelled in any picture, sorted."""
    return sorted({annotation["id_model"] for annotation in labels.anns.values()})


def detector(categories: int) -> FCOS:
    """FCOS upon a small ResNet with random weights, for boxes of all sizes up to the picture's."""
    body = ResNet(BasicBlock, list(BLOCKS))
    levels = {f"layer{2 + i}": str(i) for i in range(len(WIDTHS))}
    features = BackboneWithFPN(body, levels, list(WIDTHS), CHANNELS)
    anchors = AnchorGenerator(((8,), (16,), (32,), (64,)), ((1.0,),) * (len(WIDTHS) + 1))
    head = FCOSHead(CHANNELS, 1, categories + 1, CONVOLUTIONS)
    options = {"min_size": SIZE[1], "max_size": SIZE[0], "score_thresh": LEAST_SCORE}
    return FCOS(features, categories + 1, anchor_generator=anchors, head=head, **options)


def augmentation() -> v2.Compose:
    """Other light, another part of the picture, and its mirror image."""
    return v2.Compose(
        [
            v2.RandomPhotometricDistort(p=0.5),
            v2.RandomZoomOut(fill=114, side_range=(1, 1.5), p=0.3),
            v2.RandomIoUCrop(min_scale=0.5),
            v2.Resize(SIZE[::-1]),
            v2.RandomHorizontalFlip(),
            v2.SanitizeBoundingBoxes(min_size=2),
            v2.ToDtype(torch.float32, scale=True),
        ]
    )


def batches(count: int) -> Iterator[list[int]]:
    """The numbers of the pictures of each step, BATCH of them: all in random order, then all in another."""
    endless = itertools.chain.from_iterable(torch.randperm(count).tolist() for _ in itertools.count())
    return iter(lambda: list(itertools.islice(endless, BATCH)), None)


def trained(seen: list[torch.Tensor], true: list[dict[str, torch.Tensor]], categories: int, steps: int) -> FCOS:
    """A detector that saw these pictures, and no others, for so many steps."""
    torch.manual_seed(1)
    model, changed = detector(categories).train(), augmentation()
    optimizer = torch.optim.AdamW(model.parameters(), RATE, weight_decay=DECAY)
    rates = torch.optim.lr_scheduler.OneCycleLR(optimizer, RATE, steps, pct_start=WARM_UP)
    for chosen in itertools.islice(batches(len(seen)), steps):
        shown = [changed(seen[i], true[i]) for i in chosen]
        loss = sum(model([picture for picture, _ in shown], [target for _, target in shown]).values())
        optimizer.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(model.parameters(), LARGEST_GRADIENT)
        optimizer.step()
        rates.step()
    return model.eval()


@torch.inference_mode()
def judged(model: FCOS, seen: list[torch.Tensor], labels: COCO) -> dict[str, float]:
    """Average precision of what a detector finds in these pictures, as COCO defines it: over all overlaps, and at one half."""
    found = []
    for number, picture in zip(sorted(labels.imgs), seen, strict=True):
        said = model([picture / 255])[0]
        x0, y0, x1, y1 = said["boxes"].T
        boxes = torch.stack([x0, y0, x1 - x0, y1 - y0], dim=1).tolist()
        for box, score, category in zip(boxes, said["scores"].tolist(), said["labels"].tolist(), strict=True):
            found.append({"image_id": number, "category_id": category, "bbox": box, "score": score})
    if not found:
        return {"ap": 0.0, "ap50": 0.0}
    with contextlib.redirect_stdout(io.StringIO()):
        judge = COCOeval(labels, labels.loadRes(found), "bbox")
        judge.evaluate()
        judge.accumulate()
        judge.summarize()
    return {"ap": float(judge.stats[0]), "ap50": float(judge.stats[1])}


def learning_curve(coco: Path, sizes: list[int], steps: int) -> dict[str, Any]:
    """How good detectors are that saw so many pictures each, and what was held out from all of them."""
    train, test = labelled(coco, "train"), labelled(coco, "test")
    seen, true, unseen = pictures(coco, "train", train), targets(train), pictures(coco, "test", test)
    if len(seen) < max(sizes):
        raise SystemExit(f"{coco}: expected {max(sizes)} pictures to train on; found {len(seen)}: raise SPARE")
    curve = []
    for size in sizes:
        begun = time.perf_counter()
        model = trained(seen[:size], true[:size], len(train.cats), steps)
        curve.append({"pictures": size, **judged(model, unseen, test), "seconds": round(time.perf_counter() - begun)})
        print(curve[-1], file=sys.stderr, flush=True)
    return {
        "test_pictures": len(unseen),
        "models": {"train": models_in(train), "test": models_in(test)},
        "curve": curve,
    }


def main() -> None:
    """Render the pictures, train a detector on some, more and all of them, and say how good each is."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("out", type=Path)
    options.add_argument("--sizes", type=int, nargs="+", default=[100, 300, 1000])
    options.add_argument("--steps", type=int, default=1500)
    options.add_argument("--models", type=int, default=30)
    asked = options.parse_args()
    begun = time.perf_counter()
    vs.generate(recipe(max(asked.sizes), asked.models), asked.out / "detection", workers=2)
    rendered = round(time.perf_counter() - begun)
    found = learning_curve(asked.out / "detection" / "coco", asked.sizes, asked.steps)
    print(json.dumps({"render_seconds": rendered, **found}, indent=1))


if __name__ == "__main__":
    main()
