from __future__ import annotations

import io
import zipfile
from collections.abc import Callable

import pytest

from cbagan_ompl.inference.archives import MAX_EXPANSION, Archive, pack

MEMBERS = {"version": b"3\n", "data.pkl": b"pickle" * 100, "data/0": b"\0" * 64}


def test_members_by_their_names_without_the_folder() -> None:
    archive = Archive(pack(MEMBERS))
    assert archive.sizes == {name: len(content) for name, content in MEMBERS.items()}
    assert {name: archive.read(name) for name in MEMBERS} == MEMBERS
    with pytest.raises(ValueError, match="more than 5 bytes"):
        archive.read("data/0", 5)


def replace(data: bytes, old: bytes, new: bytes) -> bytes:
    assert old in data
    return data.replace(old, new)


def compress(size: int) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("archive/data.pkl", bytes(size))
    return buffer.getvalue()


def set_entry(data: bytes, offset: int, value: bytes) -> bytes:
    """Change a field in the last entry of the directory."""
    at = data.rindex(b"PK\x01\x02") + offset
    return data[:at] + value + data[at + len(value) :]


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda data: b"MZ" + data, "not where its directory says"),
        (lambda data: data[:-1], "not a zip file"),
        (lambda data: set_entry(data, 8, b"\1"), "encrypted"),
        (lambda data: set_entry(data, 10, b"\x0e"), "method 14"),
        (lambda data: set_entry(data, 24, b"\x41"), "two sizes"),
        (lambda data: set_entry(set_entry(data, 20, b"\x99"), 24, b"\x99"), "overlap"),
        (lambda data: replace(data, b"archive/data/0", b"another/data/0"), "not in one folder"),
        (lambda data: replace(data, b"\0" * 64, b"\1" * 64), "CRC"),
        (lambda _: compress(MAX_EXPANSION + 2**16), "expand to"),
        (lambda _: b"PK\x01\x02" * 30_000, "more than 20000 members"),
        (lambda _: b"", "not a zip file"),
    ],
)
def test_archives_that_torch_did_not_write(spoil: Callable[[bytes], bytes], message: str) -> None:
    data = spoil(pack(MEMBERS))
    with pytest.raises(Exception, match=message):
        Archive(data).read("data/0")


def test_names_that_differ_in_case_alone() -> None:
    with pytest.raises(ValueError, match="two have the same name"):
        Archive(pack({"data/0": b"", "DATA/0": b""}))
