"""Keys and patterns of keys: the part of Zenoh's rules that is used here.

Source:
    Zenoh's key expression specification: https://github.com/eclipse-zenoh/roadmap/blob/main/rfcs/ALL/Key%20Expressions.md
"""

from __future__ import annotations

import re
import zlib
from functools import lru_cache

from actionlib_core.exceptions import TransportError

_KEY = re.compile(r"[^/*$?#]+(?:/[^/*$?#]+)*")


@lru_cache(maxsize=1024)
def check_key(key: str) -> str:
    """Return `key` unchanged if it is a valid key.

    Raises:
        TransportError: it is empty, has an empty word or a character with a meaning in patterns.
    """
    if not _KEY.fullmatch(key):
        raise TransportError(
            f"key: not usable: got {key!r}; expected words with single slashes between them, "
            "without any of *$?#"
        )
    return key


def check_pattern(pattern: str) -> list[str]:
    """Return the words of a pattern.

    Raises:
        TransportError: it has an empty word.
    """
    words = pattern.split("/")
    if "" in words:
        raise TransportError(
            f"pattern: empty word: got {pattern!r}; expected words with single slashes between them"
        )
    return words


@lru_cache(maxsize=1024)
def compile_pattern(pattern: str) -> re.Pattern[str]:
    """Return a regular expression for `fullmatch` with a key and one more slash.

    `*` matches one word, `**` any number of words; neither matches a word that begins with `@`.

    Raises:
        TransportError: the pattern has an empty word.
    """
    parts = [_WORDS.get(word) or re.escape(word) + "/" for word in check_pattern(pattern)]
    return re.compile("".join(parts))


_WORDS = {"*": "[^/@][^/]*/", "**": "(?:[^/@][^/]*/)*"}


def key_matches(pattern: str, key: str) -> bool:
    """Return whether a pattern matches a key."""
    return compile_pattern(pattern).fullmatch(key + "/") is not None


_MARK = 0xC000_0000  # two bits that mark the number as ours; 30 bits of checksum follow


def key_mark(key: str) -> int:
    """Return a checksum of `key` for its messages, by which a receiver recognises other keys.

    Zenoh sends short numbers instead of keys. For a moment, when one side of a link has given it up
    and the other has not, a number may stand for another key.
    """
    return _MARK | zlib.crc32(key.encode()) >> 2


def is_for_another_key(number: int, mark: int) -> bool:
    """Return whether a message with `number` was sent on another key than the one with `mark`.

    Other programs send no number, or count their messages from 0: those are accepted.
    """
    return number >= _MARK and number != mark
