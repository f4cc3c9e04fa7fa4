"""The pickles in the archives of torch, read without executing them.

torch reads a tensor at the place, and with the shape, that a pickle says, whether the storage has
as many numbers or not: a storage that was emptied ends the process. Here the pickle is followed
opcode by opcode, and each tensor compared with its storage.
"""

from __future__ import annotations

import pickletools
from collections.abc import Mapping, Sequence
from math import prod
from typing import Any, NamedTuple

from .archives import Archive

#: Largest pickle that is followed, in bytes: some 50 for each weight, 200 for each epoch.
MAX_PICKLE_BYTES = 2**22

# Levels of tuples, lists and mappings in each other.
_MAX_DEPTH = 32

#: Bytes of a number, by the kind of its storage.
_ITEM_BYTES = {
    "torch BoolStorage": 1,
    "torch ByteStorage": 1,
    "torch CharStorage": 1,
    "torch ShortStorage": 2,
    "torch HalfStorage": 2,
    "torch BFloat16Storage": 2,
    "torch IntStorage": 4,
    "torch FloatStorage": 4,
    "torch LongStorage": 8,
    "torch DoubleStorage": 8,
}
_REBUILD = "torch._utils _rebuild_tensor_v2"
# What else is called: a mapping, lists whose items have a type, and the classes of TorchScript.
_HARMLESS = {
    "collections OrderedDict",
    "torch.jit._pickle build_boollist",
    "torch.jit._pickle build_doublelist",
    "torch.jit._pickle build_intlist",
    "torch.jit._pickle build_tensorlist",
    "torch.jit._pickle restore_type_tag",
}
_TORCHSCRIPT = "__torch__."


def check_group(archive: Archive, group: str) -> None:
    """Raise if a tensor of a group does not fit its storage.

    Args:
        archive: of torch.
        group: ``data`` or ``constants``: the pickle ``GROUP.pkl``, and its storages ``GROUP/KEY``.
            Nothing is checked where there is no such pickle.

    Raises:
        ValueError: something does not agree.
        Exception: of other types; :mod:`zipfile` and :mod:`pickletools` let several through.
    """
    pickle = f"{group}.pkl"
    if pickle in archive.sizes:
        start = len(group) + 1
        storages = {
            name[start:]: size
            for name, size in archive.sizes.items()
            if name.startswith(f"{group}/")
        }
        check_tensors(archive.read(pickle, MAX_PICKLE_BYTES), storages)


def check_tensors(pickle: bytes, sizes: Mapping[str, int]) -> None:
    """Raise if a tensor does not fit its storage, or the pickle is not of the form torch writes.

    Args:
        pickle: its bytes.
        sizes: of the storages in bytes, by their keys.

    Raises:
        ValueError: something does not agree.
        Exception: of other types; :mod:`pickletools` lets several through.
    """
    reader = _Reader(sizes)
    for opcode, argument, _ in pickletools.genops(pickle):
        reader.follow(opcode.name, argument)


class _Global(NamedTuple):
    """A class or function, which is not looked up."""

    name: str


class _Storage(NamedTuple):
    """The numbers that tensors share."""

    length: int


class _Tuple(tuple[Any, ...]):
    """A tuple that knows how deep it is nested."""

    depth: int


class _Container:
    """A list, a mapping or an object; what is in it decides nothing.

    Attributes:
        depth: levels of what is in it, and itself.
        is_open: whether something may still be added.
    """

    def __init__(self, is_open: bool = True) -> None:
        self.depth, self.is_open = 1, is_open

    def add(self, items: Sequence[Any]) -> None:
        if not self.is_open:
            raise ValueError("a pickle adds to what is complete")
        self.depth = max(self.depth, _depth_around(items))


class _Reader:
    """A machine that follows a pickle with as much of its values as the checks need.

    Args:
        sizes: of the storages in bytes, by their keys.
    """

    def __init__(self, sizes: Mapping[str, int]) -> None:
        self._sizes = sizes
        self._stacks: list[list[Any]] = [[]]  # one more for each open mark
        self._memo: dict[int, Any] = {}

    def follow(self, opcode: str, argument: Any) -> None:
        """Do what an opcode says."""
        match opcode:
            case "PROTO" | "STOP":
                return
            case "MARK":
                self._stacks.append([])
                return
            case "BINPUT" | "LONG_BINPUT":
                # A larger number makes torch allocate as many places.
                if argument > len(self._memo):
                    raise ValueError("a pickle skips numbers of stored values")
                (self._memo[argument],) = self._top()
                return
            case "BUILD" | "APPEND":
                self._top(2)
                self._add(self._pop(1))
                if opcode == "BUILD":
                    self._top()[0].is_open = False
                return
            case "SETITEM":
                self._add_pairs(self._pop(2))
                return
            case "APPENDS":
                self._add(self._pop_mark())
                return
            case "SETITEMS":
                self._add_pairs(self._pop_mark())
                return
        value = self._make(opcode, argument)
        self._stacks[-1].append(value)

    def _make(self, opcode: str, argument: Any) -> Any:  # noqa: C901 (a parser)
        """Return the value that an opcode puts on the stack."""
        match opcode:
            case "NONE" | "NEWTRUE" | "NEWFALSE" | "BINFLOAT":
                return None
            case "BININT" | "BININT1" | "BININT2" | "LONG1" | "BINUNICODE":
                return argument
            case "EMPTY_LIST" | "EMPTY_DICT":
                return _Container()
            case "EMPTY_TUPLE":
                return _make_tuple(())
            case "TUPLE1" | "TUPLE2" | "TUPLE3":
                return _make_tuple(self._pop(int(opcode[-1])))
            case "TUPLE":
                return _make_tuple(self._pop_mark())
            case "GLOBAL":
                return _Global(argument)
            case "BINGET" | "LONG_BINGET":
                value = self._memo[argument]
                if isinstance(value, _Container) and value.is_open:
                    raise ValueError("a pickle refers to a list or mapping twice")
                return value
            case "BINPERSID":
                return self._find_storage(*self._pop(1))
            case "REDUCE" | "NEWOBJ":
                return _call(*self._pop(2))
        raise ValueError(f"a pickle has the opcode {opcode}, which torch does not write")

    def _top(self, count: int = 1) -> list[Any]:
        if len(self._stacks[-1]) < count:
            raise ValueError("a pickle takes more values than it has")
        return self._stacks[-1][-count:]

    def _pop(self, count: int) -> list[Any]:
        values = self._top(count)
        del self._stacks[-1][-count:]
        return values

    def _pop_mark(self) -> list[Any]:
        if len(self._stacks) < 2:
            raise ValueError("a pickle has no mark where it needs one")
        return self._stacks.pop()

    def _add(self, items: list[Any]) -> None:
        (container,) = self._top()
        if not isinstance(container, _Container):
            raise ValueError("a pickle adds to what is no list or mapping")
        container.add(items)

    def _add_pairs(self, items: list[Any]) -> None:
        # The hash of a tuple of tuples can take for ever.
        if not all(isinstance(key, str | int) for key in items[::2]):
            raise ValueError("a key of a mapping is neither a text nor a number")
        self._add(items)

    def _find_storage(self, reference: Any) -> _Storage:
        try:
            kind, (name,), key, _, count = reference
            size = self._sizes[key]
            wanted = count * _ITEM_BYTES[name]
        except Exception:
            raise ValueError("a reference to a storage is not of the form torch writes") from None
        if kind != "storage" or size != wanted:
            raise ValueError(f"storage {key} has {size} bytes where its tensor has {wanted}")
        return _Storage(count)


def _call(function: Any, arguments: Any) -> Any:
    """Return the value of a call, a tensor where it makes one."""
    if not isinstance(function, _Global) or not isinstance(arguments, _Tuple):
        raise ValueError("a pickle calls what is no function")
    if function.name == _REBUILD:
        _check_tensor(arguments)
        return _Container(is_open=False)
    if function.name not in _HARMLESS and not function.name.startswith(_TORCHSCRIPT):
        raise ValueError(f"a pickle calls {function.name}, which is none of torch's")
    value = _Container()
    value.add(arguments)
    return value


def _check_tensor(arguments: Sequence[Any]) -> None:
    """Raise if the numbers of a tensor do not all lie in its storage."""
    storage, offset, shape, strides = arguments[:4]
    if (
        isinstance(storage, _Storage)
        and isinstance(shape, _Tuple)
        and isinstance(strides, _Tuple)
        and len(shape) == len(strides)
        and all(type(number) is int and number >= 0 for number in (offset, *shape, *strides))
    ):
        count = prod(shape)
        last = offset + sum((n - 1) * s for n, s in zip(shape, strides, strict=True))
        if count == 0 or (count <= storage.length and last < storage.length):
            return
    raise ValueError("a tensor does not lie in its storage")


def _make_tuple(items: Sequence[Any]) -> _Tuple:
    value = _Tuple(items)
    value.depth = _depth_around(items)
    return value


def _depth_around(items: Sequence[Any]) -> int:
    depth = 1 + max((getattr(item, "depth", 0) for item in items), default=0)
    if depth > _MAX_DEPTH:
        raise ValueError(f"a pickle is nested deeper than {_MAX_DEPTH} levels")
    return depth
