"""Archives that lead out of their folder, never end, lie, or cost far more than they weigh."""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import os
import struct
import subprocess
import sys
import tarfile
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest
from helpers.attacks import assert_refused, run_commands
from helpers.fuzzing import mutations, read_all
from helpers.training_set import relative_files, write_training_set

from cbagan_ompl import DatasetError
from cbagan_ompl.datasets import archive_limits
from cbagan_ompl.datasets.archives import unpack
from cbagan_ompl.datasets.importing import import_dataset

_Fields = dict[str, Any]


def _tar(members: Iterable[tuple[str, bytes, _Fields]], layout: int = tarfile.GNU_FORMAT) -> bytes:
    """Return a tar archive of members (name, content, fields of :class:`tarfile.TarInfo`)."""
    data = io.BytesIO()
    with tarfile.open(fileobj=data, mode="w", format=layout) as archive:
        for name, content, fields in members:
            info = tarfile.TarInfo(name)
            info.size = len(content)
            for field, value in fields.items():
                setattr(info, field, value)
            archive.addfile(info, io.BytesIO(content))
    return data.getvalue()


def _plain(**contents: bytes) -> bytes:
    return _tar((name, content, {}) for name, content in contents.items())


def _header(name: bytes, size: bytes, kind: bytes = b"0") -> bytes:
    """Return the header of a tar member with any bytes as its size."""
    fields = name.ljust(100, b"\0") + b"0000644\0" + bytes(16) + size.ljust(12, b"\0") + bytes(12)
    rest = kind + bytes(100) + b"ustar\00000" + bytes(247)
    checksum = sum(fields) + 8 * 32 + sum(rest)
    return (fields + b"%06o\0 " % checksum + rest)[:512]


def _zip(
    members: dict[str, bytes], method: int = zipfile.ZIP_DEFLATED, attributes: int = 0
) -> bytes:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", method) as archive:
        for name, content in members.items():
            info = zipfile.ZipInfo(name)
            info.compress_type, info.external_attr = method, attributes << 16
            archive.writestr(info, content)
    return data.getvalue()


def _change_zip(data: bytes, offset: int, layout: str, *values: int) -> bytes:
    """Return a zip archive with other fields in the first entry of its list."""
    at = data.index(b"PK\1\2") + offset
    return data[:at] + struct.pack(layout, *values) + data[at + struct.calcsize(layout) :]


def _overlapping_zip() -> bytes:
    """Return a zip archive whose list names the same bytes many times."""
    data = _zip({"a.png": bytes(10**5)})
    start = data.index(b"PK\1\2")
    end = data.index(b"PK\5\6")
    entry = data[start:end]
    tail = struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, 99, 99, 99 * len(entry), start, 0)
    return data[:start] + entry * 99 + tail


def _escape_by_links() -> Iterator[tuple[str, bytes, _Fields]]:
    """Yield members that led out of the folder through links that resolve to nothing (2025)."""
    folder, path, steps = "d" * 247, "", "abcdefghijklmnop"
    for step in steps:
        yield path + folder, b"", {"type": tarfile.DIRTYPE, "mode": 0o755}
        yield path + step, b"", {"type": tarfile.SYMTYPE, "linkname": folder}
        path += folder + "/"
    link = "/".join(steps) + "/" + "l" * 254
    yield link, b"", {"type": tarfile.SYMTYPE, "linkname": "../" * len(steps)}
    yield "escape", b"", {"type": tarfile.SYMTYPE, "linkname": link + "/../outside"}
    yield "hard", b"", {"type": tarfile.LNKTYPE, "linkname": "escape/victim"}
    yield "hard", b"overwritten\n", {}


def _zeros(megabytes: int) -> bytes:
    return bytes(megabytes * 2**20)


def _pack(packer: Any, start: bytes, megabytes: int) -> bytes:
    """Return a packed tar archive with a member of zeros."""
    parts = [packer.compress(start)]
    parts += [packer.compress(_zeros(1)) for _ in range(megabytes)]
    return b"".join(parts) + packer.flush()


_BIG = _header(b"train.csv", b"77777777777\0")

#: Archives that must be refused, and what the message says.
ATTACKS: dict[str, tuple[Callable[[], bytes], str]] = {
    "links": (lambda: _tar(_escape_by_links()), "symbolic link; only files and folders"),
    "hard-link": (
        lambda: _tar([("a", b"", {"type": tarfile.LNKTYPE, "linkname": "/etc/passwd"})]),
        "a hard link; only",
    ),
    "device": (lambda: _tar([("a", b"", {"type": tarfile.CHRTYPE})]), "of type '3'; only"),
    "pipe": (lambda: _tar([("a", b"", {"type": tarfile.FIFOTYPE})]), "of type '6'; only"),
    "sparse": (lambda: _header(b"train.csv", b"1000\0", b"S") + bytes(1024), "a sparse file"),
    "sparse-pax": (
        lambda: _tar(
            [("a", b"1", {"pax_headers": {"GNU.sparse.size": "9" * 15}})], tarfile.PAX_FORMAT
        ),
        "a sparse file",
    ),
    "upwards": (lambda: _plain(**{"a/../../outside/victim": b"x"}), "leads out of the folder"),
    "absolute": (
        lambda: _plain(**{"/tmp/cbagan-victim": b"x"}),
        "leads out of the folder",
    ),
    "nul": (
        lambda: _tar([("a", b"x", {"pax_headers": {"path": "a\0b"}})], tarfile.PAX_FORMAT),
        "leads out of the folder",
    ),
    "long-name": (lambda: _plain(**{"n" * 300: b"x"}), "a part of more than 255 bytes"),
    "longer-name": (lambda: _plain(**{"n/" * 700 + "x": b"x"}), "more than 1024 characters"),
    "deep": (lambda: _plain(**{"n/" * 40 + "x": b"x"}), "more than 32 parts"),
    "not-utf-8": (lambda: _header(b"m\xfcp", b"0\0"), "is not in UTF-8"),
    "twice": (lambda: _tar([("a", b"1", {}), ("./a", b"2", {})]), "is there twice"),
    "folder-and-file": (
        lambda: _plain(**{"a.csv": b"1", "a.csv/b.csv": b"2"}), "a file and a folder"
    ),
    "negative": (lambda: _header(b"a", b"\xff" * 12) * 80, "negative or none"),
    "negative-digits": (lambda: _header(b"a", b"-1000\0") * 80, "negative or none"),
    "negative-pax": (
        lambda: _tar([("a", b"", {"pax_headers": {"size": "-512"}})], tarfile.PAX_FORMAT),
        "negative or none",
    ),
    "no-sense-pax": (lambda: _header(b"a", b"12\0", b"x") + b"0 path=a\n".ljust(512), "no sense"),
    "huge-pax": (lambda: _header(b"a", b"77777777777\0", b"x"), "description .* too long"),
    "many-pax": (
        lambda: (_header(b"a", b"10\0", b"x") + b"8 a=bcd\n".ljust(512, b"\0")) * 9, "too long"
    ),
    "announced": (lambda: _BIG, "is truncated"),
    "gz": (lambda: _pack(zlib.compressobj(9, wbits=31), _BIG, 60), "more than 200 times"),
    "bz2": (lambda: _pack(bz2.BZ2Compressor(), _BIG, 60), "more than 200 times"),
    "xz": (lambda: _pack(lzma.LZMACompressor(), _BIG, 60), "more than 200 times"),
    "xz-memory": (
        lambda: lzma.compress(
            _plain(a=b"x"), filters=[{"id": lzma.FILTER_LZMA2, "dict_size": 2**30}]
        ),
        "damaged .*[Mm]emory",
    ),
    "gz-members": (
        lambda: gzip.compress(b"".join(_header(b"%d" % i, b"0\0") for i in range(200_000)), 1),
        "more than 131072 members",
    ),
    "gz-streams": (lambda: gzip.compress(b"") * 200_000, "too many parts"),
    "gz-cut": (lambda: gzip.compress(_plain(a=b"x"))[:-20], "truncated"),
    "gz-damaged": (lambda: gzip.compress(_plain(a=b"x"))[:20] + b"\xff" * 20, "damaged|truncated"),
    "xz-damaged": (lambda: lzma.compress(_plain(a=b"x"))[:30] + b"\xff" * 30, "damaged"),
    "bz2-damaged": (lambda: bz2.compress(_plain(a=b"x"))[:30] + b"\xff" * 30, "damaged"),
    "text": (lambda: b"some text\n" * 100, "a header that is none|negative or none"),
    "zip-link": (lambda: _zip({"a": b"/etc/passwd"}, attributes=0o120777), "a link or a device"),
    "zip-upwards": (lambda: _zip({"../outside/victim": b"x"}), "leads out of the folder"),
    "zip-absolute": (lambda: _zip({"/tmp/cbagan-victim": b"x"}), "leads out"),
    "zip-encrypted": (lambda: _change_zip(_zip({"a": b"1"}), 8, "<H", 1), "is encrypted"),
    "zip-method": (lambda: _zip({"a": b"1"}, zipfile.ZIP_LZMA), "packed by method 14"),
    "zip-overlap": (_overlapping_zip, "overlap"),
    "zip-smaller": (
        lambda: _change_zip(_zip({"a.csv": bytes(1000)}), 24, "<L", 10), "another size"
    ),
    "zip-larger": (
        lambda: _change_zip(_zip({"a.csv": bytes(10)}), 24, "<L", 1000), "another size"
    ),
    "zip-huge": (lambda: _change_zip(_zip({"a": b""}), 24, "<L", 2**32 - 2), "more than 2 GiB"),
    "zip-checksum": (lambda: _change_zip(_zip({"a.csv": b"1"}), 16, "<L", 1), "is damaged"),
    "zip-offset": (lambda: _change_zip(_zip({"a": b"1"}), 42, "<L", 2**31), "position"),
    "zip-wide": (lambda: _change_zip(_zip({"a": b"1"}), 42, "<L", 2**32 - 1), "no sense"),
    "zip-not-utf-8": (
        lambda: _zip({"aü": b"1"}).replace("ü".encode(), b"\xff\xff"), "is not in UTF-8"
    ),
    "zip-bomb": (lambda: _zip({"train.csv": _zeros(60)}), "more than 200 times"),
    "zip-count": (
        lambda: b"PK\3\4" + struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, 9, 9, 9, 0, 0), "truncated"
    ),
    "zip-members": (
        lambda: (
            b"PK\3\4"
            + struct.pack("<4sQ2H2L4Q", b"PK\6\6", 44, 0, 0, 0, 0, 2**40, 2**40, 4, 0)
            + struct.pack("<4sLQL", b"PK\6\7", 0, 4, 1)
            + struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, 65535, 65535, 0, 0, 0)
        ),
        "more than 131072 members",
    ),
    "zip-twice": (
        lambda: _zip({"a": b"1", "b": b"2"}).replace(b"b", b"a"), "is there twice"
    ),
}  # fmt: skip


@pytest.fixture(scope="module")
def archives(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("archives")
    for name, (make, _) in ATTACKS.items():
        (folder / name).write_bytes(make())
    return folder


@pytest.mark.parametrize("name", ATTACKS)
def test_attacks_are_refused_and_touch_nothing_outside(
    archives: Path, tmp_path: Path, name: str
) -> None:
    victim = tmp_path / "outside" / "victim"
    victim.parent.mkdir()
    victim.write_text("untouched\n")
    with pytest.raises(DatasetError, match=f"{name}.*{ATTACKS[name][1]}"):
        unpack(archives / name, tmp_path / "inside")
    assert victim.read_text() == "untouched\n"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["inside", "outside"]
    assert not Path("/tmp/cbagan-victim").exists()
    assert not any(path.is_symlink() for path in (tmp_path / "inside").rglob("*"))


def test_attacks_cost_little(archives: Path) -> None:
    commands = [["dataset", "import", str(archives / name)] for name in ATTACKS]
    for outcome in run_commands(commands, ["cbagan_ompl.datasets.importing"]):
        assert_refused(outcome)


def test_files_that_no_set_has_are_left_out(tmp_path: Path) -> None:
    (tmp_path / "a.tar").write_bytes(_plain(**{"a/b.csv": b"1", "c/d.PNG": b"2", "e/f": b"3"}))
    unpack(tmp_path / "a.tar", tmp_path / "copy")
    assert relative_files(tmp_path / "copy") == {"a/b.csv", "c/d.PNG"}


def test_limits_of_members_and_of_all_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a.tar").write_bytes(_plain(a=bytes(600), b=bytes(600)))
    (tmp_path / "a.zip").write_bytes(_zip({"a": bytes(600), "b": bytes(600)}))
    for kind in ("tar", "zip"):
        with monkeypatch.context() as limits:
            limits.setattr(archive_limits, "MAX_TOTAL", 1000)
            with pytest.raises(DatasetError, match="it holds more than"):
                unpack(tmp_path / f"a.{kind}", tmp_path / f"total-{kind}")
        with monkeypatch.context() as limits:
            limits.setattr("cbagan_ompl.datasets.archives.MAX_MEMBERS", 1)
            with pytest.raises(DatasetError, match="more than 1 members"):
                unpack(tmp_path / f"a.{kind}", tmp_path / f"members-{kind}")


@pytest.mark.parametrize("mode", ["w", "w:gz", "w:bz2", "w:xz"])
@pytest.mark.parametrize("layout", [tarfile.USTAR_FORMAT, tarfile.GNU_FORMAT, tarfile.PAX_FORMAT])
def test_tar_archives_of_all_kinds(tmp_path: Path, mode: str, layout: int) -> None:
    folder = tmp_path / "set" / ("x" * 90) / ("y" * 60)
    folder.mkdir(parents=True)
    (folder / "größe.png").write_bytes(bytes(range(256)) * 1000)
    (folder / "empty.png").touch()
    (tmp_path / "set" / "nothing").mkdir()
    with tarfile.open(tmp_path / "set.tar", mode, format=layout) as archive:
        archive.add(tmp_path / "set", "set")
    unpack(tmp_path / "set.tar", tmp_path / "copy")
    assert relative_files(tmp_path / "copy" / "set") == relative_files(tmp_path / "set")
    copied = tmp_path / "copy" / folder.relative_to(tmp_path) / "größe.png"
    assert copied.read_bytes() == (folder / "größe.png").read_bytes()


@pytest.mark.parametrize("method", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])
def test_zip_archives_of_all_kinds(tmp_path: Path, method: int) -> None:
    content = bytes(range(256)) * 1000
    with zipfile.ZipFile(tmp_path / "a.zip", "w", method) as archive:
        archive.mkdir("folder")
        archive.writestr("folder/größe.png", content)
        archive.writestr("empty.png", b"")
        with archive.open("wide.bmp", "w", force_zip64=True) as member:
            member.write(content)
        archive.comment = b"PK\5 is how the end begins"
    unpack(tmp_path / "a.zip", tmp_path / "copy")
    assert relative_files(tmp_path / "copy") == {"folder/größe.png", "empty.png", "wide.bmp"}
    for name in ("folder/größe.png", "wide.bmp"):
        assert (tmp_path / "copy" / name).read_bytes() == content


def test_zip_archives_of_many_members(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        for i in range(1, 66_001):  # more than fit in the end of the old format
            archive.writestr(zipfile.ZipInfo(f"{i}/"), b"")
    with pytest.raises(DatasetError, match=r"holds one train\.csv, not 0"):
        import_dataset(tmp_path / "a.zip")


def test_packed_in_several_streams(tmp_path: Path) -> None:
    data = _plain(a=bytes(5000), **{"b.csv": b"1" * 5000})
    for pack in (gzip.compress, bz2.compress, lzma.compress):
        parts = [pack(data[i : i + 3000]) for i in range(0, len(data), 3000)]
        (tmp_path / "a.tar").write_bytes(b"".join(parts) + bytes(1000))
        unpack(tmp_path / "a.tar", tmp_path / pack.__module__)
        assert (tmp_path / pack.__module__ / "b.csv").read_bytes() == b"1" * 5000


def test_a_full_disk_is_said(tmp_path: Path) -> None:
    (tmp_path / "a.tar").write_bytes(_plain(**{"a.png": bytes(5000)}))
    script = """
import resource, sys
from cbagan_ompl.cli import main
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
sys.exit(main(["dataset", "import", sys.argv[1]]))
"""
    done = subprocess.run(
        [sys.executable, "-B", "-c", script, str(tmp_path / "a.tar")],
        capture_output=True, text=True, timeout=60, env={**os.environ, "TMPDIR": str(tmp_path)},
    )  # fmt: skip
    assert done.returncode == 2, done
    assert done.stderr.endswith("a.tar: File too large\n"), done
    assert [path.name for path in tmp_path.iterdir()] == ["a.tar"]


def _valid_archives(root: Path) -> list[bytes]:
    files = {f"set/{name}": (root / name).read_bytes() for name in sorted(relative_files(root))}
    gnu = _tar((name, content, {}) for name, content in files.items())
    pax = _tar(
        (
            (name, content, {"pax_headers": {"comment": "ü"}, "mtime": 0.5})
            for name, content in files.items()
        ),
        tarfile.PAX_FORMAT,
    )
    packed = [gzip.compress(gnu), bz2.compress(pax), lzma.compress(gnu)]
    return [gnu, pax, *packed, _zip(files), _zip(files, zipfile.ZIP_STORED)]


@pytest.mark.parametrize(
    ("count", "seed"), [(500, 0), pytest.param(2000, 1, marks=pytest.mark.slow)]
)
def test_damaged_archives_are_read_or_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, count: int, seed: int
) -> None:
    if Path("/dev/shm").is_dir():  # many folders are made and removed
        monkeypatch.setattr("tempfile.tempdir", "/dev/shm")
    root = write_training_set(tmp_path / "set", maps=1, tasks=4)
    path = tmp_path / "archive"

    def load(data: bytes) -> None:
        path.write_bytes(data)
        import_dataset(path)

    counts = read_all(load, mutations(_valid_archives(root), count, seed))
    assert min(counts["read"], counts["refused"]) > count / 50
    assert sorted(path.name for path in tmp_path.iterdir()) == ["archive", "set"]
