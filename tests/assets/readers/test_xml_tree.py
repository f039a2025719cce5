"""XML by expat, beside the tree that lxml makes of the same bytes."""

import hashlib
import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lxml import etree

from deadline import DEADLINE
from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.readers.shared.xml_tree import parse_xml
from viewsphere.errors import ModelError

TEXT = '<?xml version="1.0" encoding="{}"?><a name="{}"><b>{}</b></a>'
NAMES = st.sampled_from(["a", "node", "p:path", "x:id", "id", "triangle"])
WORDS = st.text(st.characters(codec="utf-8", exclude_categories=["C"], exclude_characters="<>&\"'"), max_size=9)


def parsed(data):
    return parse_xml(ModelFolder(Path("a.dae")), data)


def plain(element):
    """An element of either library as names without prefixes, sorted attributes, text and children."""

    def local(name):
        return re.sub(r"^.*[}:]", "", name)

    attributes = {local(name): value for name, value in sorted(element.attrib.items(), key=lambda one: one[0][0] != "{")}
    children = [plain(child) for child in element if isinstance(child.tag, str)]
    return local(element.tag), sorted(attributes.items()), "".join(element.itertext()), children


@st.composite
def elements(draw, depth=2):
    name, attributes = draw(NAMES), draw(st.dictionaries(NAMES, WORDS, max_size=3))
    inside = draw(st.lists(elements(depth=depth - 1), max_size=3)) if depth else []
    between = draw(st.sampled_from(["", "<!-- said -->", "<?done?>", "<![CDATA[<p>]]>", "&#228;&lt;"]))
    said = "".join(f' {key}="{value}"' for key, value in attributes.items())
    return f"<{name}{said}>{draw(WORDS)}{between}{''.join(inside)}</{name}>"


@given(elements())
@pytest.mark.slow
def test_the_tree_is_that_of_lxml(body):
    data = f'<r xmlns="one" xmlns:p="two" xmlns:x="three">{body}</r>'.encode()
    own = parsed(data)
    own.attrib.clear()  # what declares namespaces
    assert plain(own) == plain(etree.fromstring(data, etree.XMLParser(remove_comments=True)))


@pytest.mark.parametrize(
    ("encoding", "word"),
    [
        ("utf-8", "Stühle"),
        ("utf-16", "椅子"),
        ("iso-8859-1", "Stühle"),
        ("windows-1251", "стул"),
        ("shift_jis", "椅子"),
        ("gb2312", "椅子"),
        ("euc-kr", "의자"),
    ],
)
def test_encodings(encoding, word):
    root = parsed(TEXT.format(encoding, word, word).encode(encoding))
    assert (root.get("name"), root.findtext("b")) == (word, word)


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "not well-formed XML (no element found, line 1): truncated"),
        (b"<a><b></a>", "not well-formed XML (mismatched tag, line 1)"),
        (b"<a/><b/>", "junk after document element"),
        (b"<a>\x00</a>", "not well-formed XML"),
        (TEXT.format("klingon", "a", "b").encode(), "unknown encoding: klingon): save it as UTF-8"),
        (TEXT.format("shift_jis", "a", "?").encode().replace(b"?</b>", b"\x81</b>"), "save it as UTF-8"),
        (b"<!DOCTYPE a [<!ENTITY b 'c'>]><a>&b;</a>", "declares XML entities"),
        (b"<!DOCTYPE a [<!ENTITY b SYSTEM 'file:///etc/passwd'>]><a>&b;</a>", "declares XML entities"),
        (b"<!DOCTYPE a [<!ENTITY % b SYSTEM 'file:///etc/passwd'> %b;]><a/>", "declares XML entities"),
        (b"<a>&b;</a>", "undefined entity"),
    ],
)
def test_what_is_refused(data, said):
    with pytest.raises(ModelError, match=re.escape(said)) as error:
        parsed(data)
    assert "\n" not in str(error.value)


@pytest.mark.timeout(DEADLINE)
def test_a_bomb_in_an_attribute_is_refused_at_its_declaration():
    bomb = "".join(f"<!ENTITY a{i} '{f'&a{i - 1};' * 10}'>" for i in range(1, 30))
    with pytest.raises(ModelError, match="declares XML entities"):
        parsed(f'<!DOCTYPE a [<!ENTITY a0 "haha">{bomb}]><a b="&a29;"/>'.encode())


def test_a_document_type_without_entities_and_one_elsewhere_are_read_past():
    assert parsed(b'<!DOCTYPE a SYSTEM "http://nowhere.invalid/a.dtd"><a b="1"/>').get("b") == "1"


def test_ten_thousand_elements_in_one_another():
    root = parsed(b"<a>" * 10_000 + b"</a>" * 10_000)
    assert sum(1 for _ in root.iter()) == 10_000


def test_text_of_megabytes_is_whole():
    numbers = " ".join(map(str, range(300_000)))
    text = parsed(f"<a>{numbers}</a>".encode()).text
    assert hashlib.sha256(text.encode()).digest() == hashlib.sha256(numbers.encode()).digest()
