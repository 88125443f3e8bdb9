"""Make patrol_page.gif, viewer_patrol.png and viewer_small.png from a recorded patrol.

    python docs/images/patrol_page.py

It records the mission in virtual time, serves the recording, and takes pictures of the page in
Chromium at instants of the run. Needs Chromium, and the extras sim, web and test.
"""

import io
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, Page, ViewportSize, sync_playwright

IMAGES = Path(__file__).parent
MINUTE = 60_000  # [ms]
OCTREE = Image.Quantize.FASTOCTREE  # keeps colours of which there is little: red of failures
PHONE: ViewportSize = {"width": 390, "height": 844}
DESK: ViewportSize = {"width": 1440, "height": 900}
SIZE: ViewportSize = {"width": 1200, "height": 750}
WIDTH = 800  # of the picture [pixels]
EVERY = 2000  # of the run [ms]
FRAME = 250  # of the picture [ms]
SEEK = "(ms) => smachpy.store.playback.seek(smachpy.store.data.run.first() + ms)"
BAR = """() => {
    const { page } = smachpy;
    const drives = page.timeline.bars.hits.filter((hit) => hit.span.path.endsWith("/DRIVE"));
    const { x, y } = page.timeline.canvas.getBoundingClientRect();
    const { left, right, top, bottom } = drives[2];
    return [x + (left + right) / 2, y + (top + bottom) / 2];
}"""
LENGTH = "() => smachpy.store.data.run.last() - smachpy.store.data.run.first()"


def smachpy(*arguments: str) -> list[str]:
    """Return a command."""
    return [sys.executable, "-m", "smachpy", *arguments]


def opened(browser: Browser, address: str, size: ViewportSize) -> Page:
    """Open the page, and wait until all of it is drawn."""
    page = browser.new_page(viewport=size)
    page.set_default_timeout(120_000)  # a busy computer
    page.goto(address)
    page.wait_for_selector("html[data-drawn]")
    page.wait_for_timeout(3000)  # the map, and the layout for the panels that came
    return page


def seen(page: Page) -> Image.Image:
    """Return what the page shows."""
    page.wait_for_timeout(150)
    return Image.open(io.BytesIO(page.screenshot())).convert("RGB")


def frames_of(page: Page) -> list[Image.Image]:
    """Return pictures of the page, an instant of the run each."""
    frames = []
    for instant in range(500, int(page.evaluate(LENGTH)), EVERY):
        page.evaluate(SEEK, instant)
        height = WIDTH * SIZE["height"] // SIZE["width"]
        frames.append(seen(page).resize((WIDTH, height), Image.Resampling.LANCZOS))
    return frames


def save_still(page: Page, name: str) -> None:
    """Save what the page shows."""
    file = IMAGES / name
    seen(page).quantize(256, OCTREE, dither=Image.Dither.NONE).save(file, optimize=True)
    print(f"{file}: {file.stat().st_size / 1e3:.0f} kB")


def save_film(frames: list[Image.Image]) -> None:
    """Save the pictures as one that moves."""
    palette = frames[len(frames) // 2].quantize(128, OCTREE, dither=Image.Dither.NONE)
    pictures = [f.quantize(palette=palette, dither=Image.Dither.NONE) for f in frames]
    file = IMAGES / "patrol_page.gif"
    pictures[0].save(
        file, save_all=True, append_images=pictures[1:], duration=FRAME, loop=0, optimize=True
    )
    print(f"{file}: {len(pictures)} pictures, {file.stat().st_size / 1e3:.0f} kB")


def look(address: str) -> None:
    """Make all pictures."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"]
        )
        page = opened(browser, address, DESK)
        page.evaluate(SEEK, MINUTE)
        page.mouse.move(*page.evaluate(BAR))
        page.wait_for_timeout(500)  # what is linked lights up
        save_still(page, "viewer_patrol.png")
        phone = opened(browser, address, PHONE)
        phone.evaluate(SEEK, MINUTE)
        save_still(phone, "viewer_small.png")
        save_film(frames_of(opened(browser, address, SIZE)))
        browser.close()


def main() -> None:
    """Record, look, save."""
    with tempfile.TemporaryDirectory() as folder:
        run = f"{folder}/run.jsonl"
        record = smachpy("run", "patrol", "--time", "virtual", "--plain", "--record", run)
        subprocess.run(record, check=True, stdout=subprocess.DEVNULL)
        view = subprocess.Popen(
            smachpy("view", "--port", "0", run), stdout=subprocess.PIPE, text=True
        )
        try:
            line = next(line for line in view.stdout or () if "http://" in line)
            look(line[line.index("http://") :].split()[0])
        finally:
            view.terminate()
            view.wait()


if __name__ == "__main__":
    main()
