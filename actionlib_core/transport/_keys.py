"""Keys and patterns of keys, by zenoh's rules as far as they are used here.

Source:
    Zenoh's key expression specification: https://github.com/eclipse-zenoh/roadmap/blob/main/rfcs/ALL/Key%20Expressions.md
"""

from __future__ import annotations

import re
import zlib
from functools import lru_cache

from actionlib_core.exceptions import TransportError

_KEY = re.compile(r"[^/*$?#]+(?:/[^/*$?#]+)*")


def check_key(key: str) -> str:
    """Return `key` unchanged if one can send on it.

    Raises:
        TransportError: it is empty, has an empty word or a character with a meaning in patterns.
    """
    if not _KEY.fullmatch(key):
        raise TransportError(
            f"key: not usable: got {key!r}; expected words with single slashes between them, "
            "without any of *$?#"
        )
    return key


@lru_cache(maxsize=1024)
def compile_pattern(pattern: str) -> re.Pattern[str]:
    """Return what matches the keys of a pattern in full.

    `*` stands for one word, `**` for any number of words; neither stands for a word that begins
    with `@`.

    Raises:
        TransportError: the pattern has an empty word.
    """
    words = pattern.split("/")
    if "" in words:
        raise TransportError(
            f"pattern: empty word: got {pattern!r}; expected words with single slashes between them"
        )
    parts = [_WORDS.get(word) or re.escape(word) + "/" for word in words]
    return re.compile("".join(parts))


_WORDS = {"*": "[^/@][^/]*/", "**": "(?:[^/@][^/]*/)*"}


def key_matches(pattern: str, key: str) -> bool:
    """Tell whether a pattern stands for a key."""
    return compile_pattern(pattern).fullmatch(key + "/") is not None


_MARK = 0xC000_0000


def key_mark(key: str) -> int:
    """Return the number that a message for `key` carries, so that its receiver can tell it is.

    A network library that names keys by numbers may take one for another: zenoh does for moments,
    when one side of a link has given it up and the other has not.
    """
    return _MARK | zlib.crc32(key.encode()) >> 2


def is_for_another_key(number: int, mark: int) -> bool:
    """Tell whether a message that carries `number` came to a key whose mark is not its own.

    Foreign senders carry none, or count their messages: they are trusted.
    """
    return number >= _MARK and number != mark
