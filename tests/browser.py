"""Waiting for a page in a browser."""

from __future__ import annotations

import time


def wait_for(page, condition, timeout=120.0):
    """Wait for a JavaScript condition; the page's policy forbids playwright's own way."""
    deadline = time.monotonic() + timeout
    while not page.evaluate(f"() => Boolean({condition})"):
        assert time.monotonic() < deadline, f"never true: {condition}"
        page.wait_for_timeout(50)


def stop_clock(page):
    """Stop the present of the run shown, in which a card is shown for seconds: a test may take longer to look."""
    page.evaluate(
        "() => { const now = smachpy.store.data.liveMs(); smachpy.store.data.liveMs = () => now; }"
    )


def start_clock(page):
    page.evaluate("() => { delete smachpy.store.data.liveMs; }")


def draw(page):
    """Wait until the page has drawn what has happened so far."""
    page.evaluate(
        "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done())))"
    )


def hear(page, count):
    """Wait until the page has got that many more events."""
    heard = page.evaluate("() => smachpy.store.data.run.events.at(-1)?.seq ?? 0")
    wait_for(page, f"smachpy.store.data.run.events.at(-1)?.seq >= {heard + count}")
