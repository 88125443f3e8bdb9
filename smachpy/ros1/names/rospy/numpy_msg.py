"""`numpy_msg`: messages with NumPy arrays. Here all messages accept and return them."""

from __future__ import annotations

from typing import TypeVar

T = TypeVar("T")


def numpy_msg(msg_type: T) -> T:
    """Return the message class itself; NumPy arrays fit its array fields."""
    return msg_type
