"""Archives of torch with damage that their checksums do not show."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterator

import numpy as np

from .fuzzing import mutate

_STORAGES = ("Float", "Double", "Half", "Long", "Int", "Bool", "Byte")


def damaged_members(valid: bytes, count: int, seed: int) -> Iterator[bytes]:
    """Yield variants of an archive in which one to three members are damaged."""
    rng = np.random.default_rng(seed)
    with zipfile.ZipFile(io.BytesIO(valid)) as file:
        members = {name: file.read(name) for name in file.namelist()}
    small = [name for name in members if not name.rpartition("/")[2].isdigit()]
    for _ in range(count):
        damaged = dict(members)
        for _ in range(int(rng.choice((1, 1, 2, 3)))):
            # Code, pickles and the record as often as tensors.
            among = small if rng.random() < 0.6 else list(members)
            name = among[int(rng.integers(len(among)))]
            _damage(damaged, name, rng)
        yield _pack(damaged, rng)


def _damage(members: dict[str, bytes], name: str, rng: np.random.Generator) -> None:
    content = members.get(name, b"")
    kind = rng.integers(9)
    if kind == 0:
        members[name] = b""
    elif kind == 1:
        members[name] = content[: int(rng.integers(len(content) + 1))]
    elif kind == 2:
        members[name] = content + rng.bytes(int(rng.integers(1, 4097)))
    elif kind == 3:
        members.pop(name, None)
    elif kind == 4:
        members[name] = members[list(members)[int(rng.integers(len(members)))]]
    elif kind == 5:
        one, other = (str(word).encode() for word in rng.choice(_STORAGES, size=2))
        members[name] = content.replace(one + b"Storage", other + b"Storage")
    elif kind == 6:
        members[name] = _change_number(content, rng)
    else:
        members[name] = mutate(content, rng)


def _change_number(content: bytes, rng: np.random.Generator) -> bytes:
    """Change a digit in code, or what may be a number in a pickle."""
    places = [i for i, byte in enumerate(content) if 48 <= byte <= 57 or byte in b"KMJ"]
    if not places:
        return content
    i = places[int(rng.integers(len(places)))]
    if content[i] in b"KMJ":
        return content[: i + 1] + rng.bytes(1) + content[i + 2 :]
    number = str(rng.choice((0, -1, 7, 99, 10**9, 2**31, 2**63 - 1, 2**63))).encode()
    return content[:i] + number + content[i + 1 :]


def _pack(members: dict[str, bytes], rng: np.random.Generator) -> bytes:
    buffer = io.BytesIO()
    method = zipfile.ZIP_DEFLATED if rng.random() < 0.2 else zipfile.ZIP_STORED
    with zipfile.ZipFile(buffer, "w", method) as file:
        for name, content in members.items():
            file.writestr(zipfile.ZipInfo(name), content, method)
    return buffer.getvalue()
