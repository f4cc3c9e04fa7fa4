"""YAML from users' hands: values or one kind of error, quickly."""

from __future__ import annotations

import re
import time

import pytest
from helpers.fuzzing import mutations, read_all

from cbagan_ompl import ConfigError, MapError
from cbagan_ompl.common.yaml_text import MAX_YAML_BYTES, parse_yaml

MAP = b"""\
image: office.pgm
resolution: 0.05
origin: [-2.0, -1.0, 0.0]  # metres
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
"""
RECIPE = b"""\
epochs: 20
widths: [32, 64, 96]
schedule: "one-cycle"
nested: {a: {b: [1, 2.5, null, true, 2026-11-25]}}
text: |
  two
  lines
"""


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("", None),
        ("epochs: 20", {"epochs": 20}),
        (b"\xef\xbb\xbfepochs: 20", {"epochs": 20}),
        (MAP.decode(), parse_yaml(MAP, "map", MapError)),
        ("a: [1, {b: c}]", {"a": [1, {"b": "c"}]}),
        ("&anchor 1", 1),
        ("größe: ∞", {"größe": "∞"}),
        (MAP.decode().replace(": ", ":\t"), parse_yaml(MAP, "map", MapError)),
        (MAP.replace(b": ", b": \t ").replace(b", ", b",\t"), parse_yaml(MAP, "map", MapError)),
        (MAP.replace(b"\n", b"\t\r\n\t \r\n"), parse_yaml(MAP, "map", MapError)),
        ("a:\t1\t# one\n\t# none\nb: [\t2,\n\t3]\t", {"a": 1, "b": [2, 3]}),
        ("a:\n  - b:\tc\n    d:\t'e\tf'", {"a": [{"b": "c", "d": "e\tf"}]}),
        ("-\t1\n- \t2", [1, 2]),
    ],
)
def test_what_is_read(text: str | bytes, value: object) -> None:
    assert parse_yaml(text, "recipe.yaml", ConfigError) == value


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a: &x [1]\nb: *x", r"aliases such as \*x are not read.*line 2"),
        ("a: *nobody", r"aliases such as \*nobody are not read"),
        ("[" * 30 + "]" * 30, "nested deeper than 20 levels"),
        ("? " * 200_000, "of more than 64 KiB"),
        ("- " * 30_000, "nested deeper than 20 levels"),
        ("a:\n\t- 1", "tabs may separate words, but not indent lines"),
        ("a:\n\tb: 1", "tabs may separate words, but not indent lines"),
        ("\ta: 1", "tabs may separate words, but not indent lines"),
        ("-\ta: 1", "mapping values are not allowed here"),
        ("a: [1", "expected"),
        ("--- 1\n--- 2", "single document"),
        ("a: \0", "special characters"),
        (b"\xff\xfe\xff", "no valid YAML"),
        (b"a: \xc3", "no valid YAML"),
        ('a: !!int ""', "no valid YAML: "),
        ("a: !!timestamp x", "no valid YAML: "),
        ("a: 2026-13-01", "month must be in 1..12"),
        ("a: " + "9" * 5000, "no valid YAML: "),
        ("a: !!float x", "no valid YAML: "),
        ("a: !!binary x", "no valid YAML: "),
        ("? [a]\n: 1\n? {b: 1}\n: 2", "no valid YAML: "),
        ("!!python/object/apply:os.system ['true']", "could not determine a constructor"),
        ("!!python/name:os.system", "could not determine a constructor"),
        ("%YAML 9.9\n--- 1", "no valid YAML: "),
        ("a: 1" + ":1" * 400 + ".5", "no valid YAML: "),
    ],
)
def test_what_is_an_error(text: str | bytes, said: str) -> None:
    with pytest.raises(ConfigError) as caught:
        parse_yaml(text, "recipe.yaml", ConfigError)
    message = str(caught.value)
    assert message.startswith("recipe.yaml: ")
    assert len(message) < 500
    assert re.search(said, message, re.DOTALL), message


def repeated(piece: str, begin: str = "", end: str = "") -> str:
    count = (MAX_YAML_BYTES - len(begin) - len(end)) // len(piece)
    return begin + piece * count + end


@pytest.mark.parametrize(
    "text",
    [
        repeated("1,", "[", "1]"),
        repeated("a: 1, ", "{", "}"),
        repeated("- a: 1\n"),
        repeated("<<: {a: 1}\n"),
        repeated("1:", "a: ", "1"),
        repeated("b, ", "[a, " * 15),
        repeated("\\u0041", '"', '"'),
        repeated("#\n"),
        repeated("[[[],[]],", "["),
        repeated("9"),
        repeated(" a\n", ">\n"),
        "".join(f"a{i}: 1\n" for i in range(6000)),
    ],
    ids=lambda text: repr(text[:12]),
)
def test_the_largest_texts_take_little_time(text: str) -> None:
    assert len(text) <= MAX_YAML_BYTES
    began = time.process_time()
    read_all(lambda data: parse_yaml(data, "map.yaml", MapError), iter([text.encode()]))
    # Half a second on an idle machine; what grows with the square of the length takes minutes.
    assert time.process_time() - began < 10


def test_longer_texts_are_not_parsed() -> None:
    with pytest.raises(MapError, match=r"map\.yaml: YAML of more than 64 KiB is not read"):
        parse_yaml(b" " * (MAX_YAML_BYTES + 1), "map.yaml", MapError)


def test_damaged_texts() -> None:
    texts = mutations([MAP, RECIPE], 8000, seed=0)
    counts = read_all(lambda data: parse_yaml(data, "map.yaml", MapError), texts)
    assert min(counts["read"], counts["refused"]) > 1000
