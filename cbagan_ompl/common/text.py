"""Names and other texts from users' hands, made fit for logs, tables and figures."""

from __future__ import annotations

from zlib import crc32


def one_line(text: str, longest: int = 200) -> str:
    r"""Return a text as one line of printable characters that has an encoding in UTF-8.

    Line breaks, control characters and bytes of file names that are no UTF-8 become escapes. A text
    that is too long is shortened; a checksum at its end keeps two of them apart.

    Args:
        text: the text.
        longest: most characters of the result, at least 20.

    Example:
        >>> one_line("maze\n2"), one_line("x" * 300, 20)
        ('maze\\n2', 'xxxxxxxxx...1b432d13')
    """
    line = text
    if not text.isprintable():
        line = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)
    if len(line) <= longest:
        return line
    return f"{line[: longest - 11]}...{crc32(line.encode()):08x}"
