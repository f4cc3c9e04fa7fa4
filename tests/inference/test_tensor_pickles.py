from __future__ import annotations

import io
import pickle
import struct
from collections import OrderedDict
from typing import Any

import pytest

from cbagan_ompl.inference.archives import Archive, pack
from cbagan_ompl.inference.tensor_pickles import MAX_PICKLE_BYTES, check_group, check_tensors

torch = pytest.importorskip("torch")


def saved(value: Any) -> Archive:
    buffer = io.BytesIO()
    torch.save(value, buffer)
    return Archive(buffer.getvalue())


def test_what_torch_saves() -> None:
    weights = torch.arange(12.0).view(3, 4)
    state = OrderedDict(
        weights=weights,
        turned=weights.T,
        part=weights[1:, 2:],
        same=weights,
        empty=torch.zeros(0, 3),
        number=torch.tensor(3),
        kinds=[torch.zeros(5, dtype=kind) for kind in (torch.bool, torch.uint8, torch.bfloat16)],
        others=(None, True, 1.5, -7, 2**40, "text", [], {}, (1, (2, 3))),
    )
    check_group(saved(state), "data")
    check_group(Archive(pack({"version": b"3"})), "data")


@pytest.mark.parametrize("size", [0, 4, 47, 49, 96])
def test_storages_of_other_lengths(size: int) -> None:
    archive = saved(torch.zeros(12))
    archive.sizes["data/0"] = size
    with pytest.raises(ValueError, match=f"storage 0 has {size} bytes where its tensor has 48"):
        check_group(archive, "data")


class Rebuilt:
    """A tensor with any geometry: (offset, size, stride)."""

    def __init__(self, *geometry: Any) -> None:
        self.geometry = geometry

    def __reduce__(self) -> Any:
        storage = torch.zeros(4).storage()
        return torch._utils._rebuild_tensor_v2, (storage, *self.geometry, False, OrderedDict())


@pytest.mark.parametrize(
    "geometry",
    [
        (1, (4,), (1,)),
        (0, (5,), (1,)),
        (0, (2, 3), (1, 1)),
        (0, (2,), (4,)),
        (-1, (4,), (1,)),
        (0, (4,), (-1,)),
        (0, (-4,), (1,)),
        (0, (10**9, 10**9), (0, 0)),
        (0, (4,), (1, 1)),
        (0, 4, 1),
        (0, (2**62, 2**62), (1, 1)),
    ],
)
@pytest.mark.filterwarnings("ignore:TypedStorage is deprecated")
def test_tensors_beyond_their_storage(geometry: Any) -> None:
    with pytest.raises(ValueError, match="does not lie in its storage"):
        check_group(saved(Rebuilt(*geometry)), "data")


class Call:
    def __reduce__(self) -> Any:
        return print, ("executed",)


def nested(depth: int) -> Any:
    value: Any = ()
    for _ in range(depth):
        value = (value, value)
    return value


SHARED: list[int] = []
RECURSIVE: list[Any] = []
RECURSIVE.append(RECURSIVE)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (pickle.dumps(Call(), 2), "calls __builtin__ print"),
        (pickle.dumps(nested(40), 2), "nested deeper"),
        (pickle.dumps({nested(3): 1}, 2), "a key of a mapping"),
        (pickle.dumps([SHARED, SHARED], 2), "refers to a list or mapping twice"),
        (pickle.dumps(RECURSIVE, 2), "refers to a list or mapping twice"),
        (pickle.dumps({1, 2}, 4), "opcode"),
        (b"\x80\x02Nr" + struct.pack("<I", 2**31) + b".", "skips numbers"),
        (b"\x80\x02h\x05.", "5"),
        (b"\x80\x02t.", "no mark"),
        (b"\x80\x02\x85.", "more values than it has"),
        (b"\x80\x02N(R.", "more values than it has"),
        (b"\x80\x02NNa.", "no list or mapping"),
        (b"\x80\x02NNb.", "no list or mapping"),
        (b"\x80\x02NNR.", "no function"),
        (b"\x80\x02NQ.", "reference to a storage"),
        (b"\x80\x02I1\n.", "opcode INT"),
        (b"\x80\x02X\xff\xff\xff\x7fshort.", "2147483647"),
        (b"\x80\x02N", "STOP"),
        (b"\x80\x02\xff.", "unknown"),
        (b"", "STOP"),
    ],
)
def test_pickles_that_torch_does_not_write(
    data: bytes, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(Exception, match=message):
        check_tensors(data, {})
    assert not capsys.readouterr().out


def test_long_pickles() -> None:
    with pytest.raises(ValueError, match=f"more than {MAX_PICKLE_BYTES} bytes"):
        check_group(Archive(pack({"data.pkl": bytes(MAX_PICKLE_BYTES + 1)})), "data")
