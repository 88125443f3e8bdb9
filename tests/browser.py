"""Waiting for a page in a browser."""

from __future__ import annotations

import time


def wait_for(page, condition, timeout=30.0):
    """Wait for a JavaScript condition; the page's policy forbids playwright's own way."""
    deadline = time.monotonic() + timeout
    while not page.evaluate(f"() => Boolean({condition})"):
        assert time.monotonic() < deadline, f"never true: {condition}"
        page.wait_for_timeout(50)
