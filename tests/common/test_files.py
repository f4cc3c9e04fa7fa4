"""Reading and writing files whole: regular files only, size limits, nothing left behind."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from helpers.fuzzing import mutations, read_all

from cbagan_ompl import ConfigError, DatasetError, MapError, ModelError
from cbagan_ompl.common.files import (
    check_folder,
    make_folder,
    open_regular,
    read_bytes,
    read_text,
    reason,
    write_atomically,
    write_json,
)


def no_file(folder: Path) -> Path:
    return folder / "none.png"


def folder_itself(folder: Path) -> Path:
    return folder


def pipe(folder: Path) -> Path:
    os.mkfifo(folder / "pipe.png")
    return folder / "pipe.png"


def unix_socket(folder: Path) -> Path:
    path = folder / "s"
    with socket.socket(socket.AF_UNIX) as one:
        one.bind(str(path))
    return path


def link_to_nothing(folder: Path) -> Path:
    (folder / "link.png").symlink_to(folder / "none")
    return folder / "link.png"


def link_to_itself(folder: Path) -> Path:
    (folder / "link.png").symlink_to(folder / "link.png")
    return folder / "link.png"


UNREADABLE: list[tuple[Callable[[Path], Path], str]] = [
    (no_file, "No such file or directory"),
    (folder_itself, "it is a folder, not a file"),
    (pipe, "it is a device or a pipe, not a file"),
    (unix_socket, "No such device or address"),
    (link_to_nothing, "No such file or directory"),
    (link_to_itself, "Too many levels of symbolic links"),
    (lambda _: Path("/dev/zero"), "it is a device or a pipe, not a file"),
    (lambda _: Path("/dev/full"), "it is a device or a pipe, not a file"),
    (lambda folder: folder / ("x" * 300), "File name too long"),
    (lambda folder: folder / "a\0b", "embedded null"),
    (lambda folder: folder / "none" / "a", "No such file or directory"),
]


@pytest.mark.parametrize(("make", "said"), UNREADABLE, ids=lambda v: getattr(v, "__name__", ""))
@pytest.mark.parametrize("read", [read_bytes, read_text, open_regular])
def test_what_cannot_be_read(
    tmp_path: Path, make: Callable[[Path], Path], said: str, read: Callable[..., object]
) -> None:
    path = make(tmp_path)
    for error_class in (MapError, ModelError, DatasetError):
        with pytest.raises(error_class) as caught:
            read(path, error_class)
        assert str(caught.value).startswith("cannot read ")
        assert said in str(caught.value)


def test_a_pipe_with_a_writer_is_not_waited_for(tmp_path: Path) -> None:
    path = pipe(tmp_path)
    descriptor = os.open(path, os.O_RDWR)
    try:
        with pytest.raises(MapError, match="a device or a pipe"):
            read_bytes(path)
    finally:
        os.close(descriptor)


def test_content_and_limit(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"12345678")
    assert read_bytes(path) == b"12345678"
    assert read_bytes(path, limit=8) == b"12345678"
    with pytest.raises(MapError, match=r"more than the 6\.67572e-06 MiB"):
        read_bytes(path, limit=7)
    path.write_bytes(b"")
    assert read_bytes(path, limit=0) == b""


def test_a_sparse_file_above_the_limit_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "sparse"
    with path.open("wb") as file:
        file.truncate(2**40)
    with pytest.raises(MapError, match="more than the 1024 MiB"):
        read_bytes(path)
    with pytest.raises(MapError, match="more than the 64 MiB"):
        read_text(path)


def test_a_file_of_the_kernel_that_says_it_is_empty() -> None:
    assert b"MemTotal" in read_bytes(Path("/proc/meminfo"))
    with pytest.raises(MapError, match="more than"):
        read_bytes(Path("/proc/meminfo"), limit=10)


def test_links_to_files_are_read(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"x")
    (tmp_path / "link").symlink_to(tmp_path / "a")
    assert read_bytes(tmp_path / "link") == b"x"


def test_no_descriptor_is_left_open(tmp_path: Path) -> None:
    before = len(os.listdir("/proc/self/fd"))
    for make, _ in UNREADABLE[:3]:
        path = make(tmp_path)
        for _ in range(50):
            with pytest.raises(MapError):
                read_bytes(path)
    assert len(os.listdir("/proc/self/fd")) <= before + 1


@pytest.mark.parametrize(
    ("data", "text"),
    [(b"", ""), ("größe".encode(), "größe"), (b"\xef\xbb\xbfa\r\nb", "a\r\nb"), (b"\0", "\0")],
)
def test_texts(tmp_path: Path, data: bytes, text: str) -> None:
    (tmp_path / "a").write_bytes(data)
    assert read_text(tmp_path / "a") == text


@pytest.mark.parametrize("data", [b"\xff", b"a\xc3", b"\xed\xa0\x80", "a".encode("utf-16")])
def test_what_is_no_text(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "a").write_bytes(data)
    with pytest.raises(ConfigError, match="is no text file in UTF-8"):
        read_text(tmp_path / "a", ConfigError)


def test_reasons() -> None:
    assert reason(OSError(28, "No space left on device", "/x")) == "No space left on device"
    assert reason(OSError("odd")) == "odd"
    assert reason(ValueError("embedded null byte")) == "embedded null byte"
    assert reason(KeyError("a")) == "'a'"


def test_folders_of_outputs(tmp_path: Path) -> None:
    check_folder(None)
    check_folder(str(tmp_path / "a.png"))
    check_folder("a.png")
    for path in ("none/a.png", "a\0b/c"):
        with pytest.raises(ConfigError, match="its folder does not exist"):
            check_folder(str(tmp_path / path))


def test_folders_are_made_once(tmp_path: Path) -> None:
    for _ in range(2):
        make_folder(tmp_path / "a" / "b")
    (tmp_path / "file").touch()
    for path in (tmp_path / "file", tmp_path / "file" / "c", tmp_path / ("x" * 300)):
        with pytest.raises(ModelError, match="cannot make the folder"):
            make_folder(path, ModelError)
    with pytest.raises(ConfigError, match="cannot make the folder"):
        make_folder(Path("a\0b"))


def test_writing_replaces_the_whole_file(tmp_path: Path) -> None:
    path = tmp_path / "a"
    for data in ("größe", b"\0\xff", b"", "x" * 10**6):
        write_atomically(path, data)
        assert path.read_bytes() == (data.encode() if isinstance(data, str) else data)
    write_json(path, {"größe": [1, None]})
    assert path.read_text() == '{\n  "gr\\u00f6\\u00dfe": [\n    1,\n    null\n  ]\n}\n'
    assert os.listdir(tmp_path) == ["a"]


def test_written_files_have_the_usual_permissions(tmp_path: Path) -> None:
    (tmp_path / "usual").touch()
    write_atomically(tmp_path / "ours", "")
    assert (tmp_path / "ours").stat().st_mode == (tmp_path / "usual").stat().st_mode


def test_a_link_is_kept_and_its_file_written(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    link = tmp_path / "link"
    link.symlink_to(tmp_path / "folder" / "a")
    for data in ("first", "second"):
        write_atomically(link, data)
        assert link.is_symlink()
        assert (tmp_path / "folder" / "a").read_text() == data
    assert os.listdir(tmp_path / "folder") == ["a"]


def test_long_names_and_files_beside_are_left_alone(tmp_path: Path) -> None:
    beside = tmp_path / "a.tmp"
    beside.write_text("mine")
    write_atomically(tmp_path / "a", "x")
    assert beside.read_text() == "mine"
    longest = tmp_path / ("n" * 255)
    write_atomically(longest, "x")
    assert longest.read_text() == "x"


UNWRITABLE: list[tuple[Callable[[Path], Path], str]] = [
    (folder_itself, "it is a folder, not a file"),
    (pipe, "it is a device or a pipe, not a file"),
    (unix_socket, "it is a device or a pipe, not a file"),
    (lambda _: Path("/dev/null"), "it is a device or a pipe, not a file"),
    (lambda folder: folder / "none" / "a", "No such file or directory"),
    (lambda folder: folder / ("x" * 300), "File name too long"),
    (lambda folder: folder / "a\0b", "embedded null"),
]


@pytest.mark.parametrize(("make", "said"), UNWRITABLE, ids=lambda v: getattr(v, "__name__", ""))
def test_what_cannot_be_written(tmp_path: Path, make: Callable[[Path], Path], said: str) -> None:
    path = make(tmp_path)
    before = sorted(os.listdir(tmp_path))
    with pytest.raises(ModelError) as caught:
        write_atomically(path, "x", ModelError)
    assert str(caught.value).startswith("cannot write ")
    assert said in str(caught.value)
    assert sorted(os.listdir(tmp_path)) == before


# A disk that is full is rehearsed by a limit on the size of files.
_FULL_DISK = """
import resource, signal, sys
from cbagan_ompl import ConfigError
from cbagan_ompl.common.files import write_atomically
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
try:
    write_atomically(sys.argv[1], b"x" * 5000)
except ConfigError as error:
    print(error)
"""


def test_a_full_disk_leaves_the_old_file(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("old")
    done = subprocess.run(
        [sys.executable, "-B", "-c", _FULL_DISK, str(tmp_path / "a")],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == f"cannot write {tmp_path}/a: File too large\n"
    assert os.listdir(tmp_path) == ["a"]
    assert (tmp_path / "a").read_text() == "old"


@pytest.mark.parametrize("error", [KeyboardInterrupt, OSError(28, "No space left on device")])
def test_what_happens_meanwhile_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException
) -> None:
    def fail(*_: object) -> None:
        raise error

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises((KeyboardInterrupt, ConfigError)):
        write_atomically(tmp_path / "a", "x")
    assert os.listdir(tmp_path) == []


def test_damaged_texts_are_read_or_raise(tmp_path: Path) -> None:
    path = tmp_path / "a"

    def read(data: bytes) -> str:
        path.write_bytes(data)
        return read_text(path)

    counts = read_all(read, mutations(["Größe: 3 ∞\n".encode(), b"size: 3\n" * 5], 1000, seed=0))
    assert min(counts.values()) > 200
