"""A browser, and waiting for a page in it."""

from __future__ import annotations

import contextlib
import shutil
import time

import pytest

# The shell has no window and no services of a desktop: with it the tests take half of the CPU time.
BROWSERS = ("chromium-headless-shell", "chromium", "chromium-browser")
CHROMIUM = next(filter(None, map(shutil.which, BROWSERS)), None)
FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--disable-background-networking",
    "--font-render-hinting=none",  # texts are as wide in the shell as they are on a screen
]


@contextlib.contextmanager
def opened_browser():
    """A browser for a `with`; where there is none the test is skipped."""
    if CHROMIUM is None:
        pytest.skip("needs a browser; try: .ci/chromium")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        try:
            yield browser
        finally:
            browser.close()


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
