"""scripts/language: what counts as prose, and a figure worse than its limit names the page and a sentence."""

import json
import sys

import pytest

from small import ROOT

sys.path.insert(0, str(ROOT / "scripts"))
import language
from language import Text, is_worse, joined, markdown, tightened

PAGE = """# Heading: what which whose

You render `what you say` with [your recipe](what.md). It takes a minute.

```sh
what which whose those
```

<!-- options of coco, written by scripts/docs -->

| field | meaning |
|---|---|
| `a` | what it says |

<!-- end -->

| you want to | read |
|---|---|
| train | this page |

- Tell nobody.
"""


def test_prose_excludes_code_headings_and_generated_tables():
    page = markdown("page.md", PAGE)
    assert page.sentences == ["You render Code with your recipe.", "It takes a minute."]
    assert [cell.strip() for cell in page.cells] == ["you want to", "read", "train", "this page"]
    assert page.figure("noun clauses") == 0
    assert page.figure("you") == round(3000 / 19, 1)
    assert page.figure("speech") == round(1000 / 19, 1)


def test_long_sentences_show_in_the_percentile_alone():
    page = Text("page.md", ("A cat sat here. " * 8 + "A cat sat " + "and sat " * 20 + "here. ",))
    assert (page.figure("median sentence"), page.figure("long sentence")) == (4, 44)


@pytest.mark.parametrize(
    ("measure", "figure", "limit", "worse", "then"),
    [
        ("you", 5, 4, False, 5),
        ("you", 3, 4, True, 4),
        ("you", 20, 4, False, 8),
        ("speech", 5, 4, True, 4),
        ("speech", 3, 4, False, 3),
        ("speech", 0, 4, False, 1),
    ],
)
def test_limits_move_towards_the_target_alone(measure, figure, limit, worse, then):
    assert (is_worse(measure, figure, limit), tightened(measure, figure, limit)) == (worse, then)


def test_a_worse_figure_fails_with_page_and_sentence(monkeypatch, tmp_path):
    texts = [Text("good.md", ("You read this page first.",)), Text("bad.md", ("It renders. Nobody knows what is said of it.",))]
    limits = tmp_path / "limits.json"
    limits.write_text(json.dumps({"guides": {"speech": 1.0}}))
    monkeypatch.setattr(language, "LIMITS", limits)
    monkeypatch.setattr(language, "GROUPS", {"guides": (lambda: texts, ("speech",))})
    monkeypatch.setattr(sys, "argv", ["language", "--tighten"])
    with pytest.raises(SystemExit, match=r"speech is 142.9; its limit is 1. .*\n  bad.md .*: Nobody knows what is said of it."):
        language.main()
    assert json.loads(limits.read_text()) == {"guides": {"speech": 1.0}}
    assert joined(texts).figure("you") > 0
