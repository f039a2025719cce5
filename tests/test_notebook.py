"""In notebooks, recipes, plans, frames, data sets and samples show what they are, with labels over their pictures."""

import io
import re
from base64 import b64decode
from html.parser import HTMLParser

import numpy as np
from PIL import Image

import viewsphere as vs
from small import small_recipe


def pictures(html):
    found = re.findall(r'src="data:image/png;base64,([^"]+)"', html)
    return [np.asarray(Image.open(io.BytesIO(b64decode(data))).convert("RGB")) for data in found]


def words(html):
    said, parser = [], HTMLParser()
    parser.handle_data = said.append
    parser.feed(html)
    return " ".join(said)


def test_samples_show_their_picture_with_labels_and_their_objects(small_run):
    sample = vs.open(small_run)[0]
    html = sample._repr_html_()
    (picture,) = pictures(html)
    box = sample.objects[0].box2d
    changed = (picture != sample.rgb).any(axis=2)
    assert picture.shape == sample.rgb.shape
    assert changed[sample.objects[0].mask].mean() > 0.5
    assert changed.mean() < 0.9
    assert f"box {', '.join(f'{x:g}' for x in box)}" in words(html)
    assert all(name in words(html) for name in sample.channels)


def test_samples_without_pictures_show_their_facts():
    sample = next(vs.render(small_recipe(channels=["depth"])))
    assert not pictures(sample._repr_html_())
    assert "post box" in words(sample._repr_html_())


def test_data_sets_show_some_of_their_samples(small_run):
    html = vs.open(small_run)._repr_html_()
    (sheet,) = pictures(html)
    assert sheet.shape[1] > 3 * 96
    assert "12" in words(html)
    assert "train" in words(html)


def test_recipes_and_plans_show_what_they_say():
    recipe = small_recipe(name="<small> & co")
    assert all(line.strip() in words(recipe._repr_html_()) for line in recipe.to_yaml().splitlines())
    assert "<small>" not in recipe._repr_html_()
    for shown in (vs.plan(recipe), vs.render(recipe)):
        assert "2 models x 6 poses = 12" in words(shown._repr_html_())
