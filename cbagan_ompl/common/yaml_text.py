"""YAML as users write it: no aliases, no deep nesting, and errors of one kind."""

from __future__ import annotations

from typing import Any

import yaml

from ..errors import CbaganOmplError, show

#: Largest YAML text that is read, in bytes: PyYAML takes up to a second for a tenth of a megabyte.
MAX_YAML_BYTES = 2**16

# Levels of lists and mappings in each other.
_MAX_DEPTH = 20

# What PyYAML says of text that it cannot parse has several lines; the first ones say it.
_LONGEST_REASON = 300


def parse_yaml(
    text: bytes | str, name: str, error_class: type[CbaganOmplError]
) -> Any:  # whatever the text holds
    """Return the value of a YAML text: numbers, texts, lists and mappings.

    Aliases (``*name``) are an error, because a few lines of them can stand for gigabytes.

    Args:
        text: in UTF-8 where it is bytes; at most :data:`MAX_YAML_BYTES`.
        name: of the file or option, for the message.
        error_class: what to raise.

    Raises:
        CbaganOmplError: of that class; the text is no YAML, is too long or nested too deeply, or
            has aliases.

    Example:
        >>> from cbagan_ompl import ConfigError
        >>> parse_yaml("epochs: 20", "recipe.yaml", ConfigError)
        {'epochs': 20}
    """
    if len(text) > MAX_YAML_BYTES:
        raise error_class(f"{name}: YAML of more than {MAX_YAML_BYTES // 2**10} KiB is not read")
    try:
        return yaml.load(text, _Loader)
    except Exception as error:  # PyYAML lets whatever Python raises for odd values through
        raise error_class(f"{name}: no valid YAML: {_describe(error)}") from error


class _Loader(yaml.SafeLoader):
    """PyYAML's safe loader without aliases, with a limit on the depth, and with tabs.

    YAML lets blanks and tabs separate what stands on a line, and blanks alone indent it
    (https://yaml.org/spec/1.2.2/#62-separation-spaces). PyYAML takes no tabs at all.
    """

    def __init__(self, stream: bytes | str) -> None:
        super().__init__(stream)
        self._depth = 0

    def scan_to_next_token(self) -> None:
        """Skip blanks, comments and line breaks, and tabs where they do not indent a block."""
        while True:
            super().scan_to_next_token()
            if self.peek() != "\t" or self._indents():
                return
            if not self.flow_level:
                self.allow_simple_key = False  # "-<tab>key: value" would be a block
            self.forward()

    def _indents(self) -> bool:
        """Return whether what is at the place of a tab indents a line of a block."""
        if self.flow_level or self.buffer[self.pointer - self.column : self.pointer].strip():
            return False
        length = 0
        while self.peek(length) in " \t":
            length += 1
        return self.peek(length) not in "#\0\r\n"

    def compose_node(self, parent: Any, index: Any) -> Any:
        if self.check_event(yaml.AliasEvent):
            event = self.peek_event()  # type: ignore[no-untyped-call]
            raise yaml.composer.ComposerError(
                None, None, f"aliases such as *{event.anchor} are not read", event.start_mark
            )
        self._depth += 1
        if self._depth > _MAX_DEPTH:
            mark = self.peek_event().start_mark  # type: ignore[no-untyped-call]
            raise yaml.composer.ComposerError(
                None, None, f"nested deeper than {_MAX_DEPTH} levels", mark
            )
        node = super().compose_node(parent, index)
        self._depth -= 1
        return node


def _describe(error: Exception) -> str:
    text = " ".join(str(error).split()) or type(error).__name__
    if "'\\t'" in text:
        text += "; tabs may separate words, but not indent lines: use blanks for that"
    return text if len(text) <= _LONGEST_REASON else show(text)
