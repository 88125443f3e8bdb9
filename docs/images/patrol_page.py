"""Make patrol_page.gif and the pictures viewer_*.png.

    python docs/images/patrol_page.py

It records the patrol in virtual time, serves the recording, and takes pictures of the page in
Chromium at instants of the run; then of machines that run meanwhile, made for the tests, and of
the simulated robot. Needs Chromium, and the extras sim, web and test.
"""

import contextlib
import io
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, Page, ViewportSize, sync_playwright

from actionlib_core.wire.private_network import private_network

IMAGES = Path(__file__).parent
ROBOT = IMAGES.parents[1] / "tests/viz/live/robot.py"  # machines of any size
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


@contextlib.contextmanager
def started(*command: str) -> Iterator[str]:
    """Run a program that ends with its standard input; yield the line that it says first."""
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as program:
        assert program.stdout is not None
        yield program.stdout.readline().strip()
        program.communicate()


def opened(browser: Browser, address: str, size: ViewportSize, *, dark: bool = False) -> Page:
    """Open the page, and wait until all of it is drawn."""
    page = browser.new_page(viewport=size, color_scheme="dark" if dark else "light")
    page.set_default_timeout(120_000)  # a busy computer
    page.goto(address)
    page.wait_for_selector("html[data-drawn], .actions-page")
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


def look_at_patrol(browser: Browser, folder: str) -> None:
    """Make the pictures of a recorded patrol."""
    run = f"{folder}/run.jsonl"
    record = smachpy("run", "patrol", "--time", "virtual", "--plain", "--record", run)
    subprocess.run(record, check=True, stdout=subprocess.DEVNULL)
    with viewer(run) as address:
        page = opened(browser, address, DESK)
        page.evaluate(SEEK, MINUTE)
        page.mouse.move(*page.evaluate(BAR))
        page.wait_for_timeout(500)  # what is linked lights up
        save_still(page, "viewer_patrol.png")
        phone = opened(browser, address, PHONE)
        phone.evaluate(SEEK, MINUTE)
        save_still(phone, "viewer_small.png")
        save_film(frames_of(opened(browser, address, SIZE)))


def look_at_preempt(browser: Browser) -> None:
    """Make the picture of a preempt that a state holds up."""
    with machine("--name", "delivery", "--hold", "--rate", "2", "--control"), viewer() as address:
        page = opened(browser, address, DESK)
        page.wait_for_selector(".crumbs >> text=TRANSPORT")
        page.click("#preempt")
        page.click(".confirm .warn")
        page.wait_for_timeout(6000)  # of waiting, to be seen in the bars
        save_still(page, "viewer_preempt.png")


def look_at_large(browser: Browser, states: int, name: str, *, dark: bool = False) -> None:
    """Make the picture of a machine of many states, followed."""
    with machine("--name", "factory", "--states", str(states), "--rate", "2"), viewer() as address:
        page = opened(browser, address, DESK, dark=dark)
        page.click("button:text-is('Follow')")
        page.wait_for_timeout(20_000)  # for bars in its lanes
        save_still(page, name)


def look_at_goal(browser: Browser) -> None:
    """Make the picture of a goal that is being sent."""
    with started(*smachpy("robot", "--child")), viewer() as address:
        page = opened(browser, address.replace("/#", "/?actions#"), DESK)
        page.click(".action:has(b:text-is('/move_base'))")
        goal = {"header.frame_id": "map", "pose.position.x": "3.5", "pose.position.y": "2.0"}
        for field, value in goal.items():
            page.fill(f'[id="$.target_pose.{field}"]', value)
        page.click("#send-goal")
        page.wait_for_selector(".sent.active")
        page.wait_for_timeout(5000)  # it drives
        save_still(page, "viewer_actions.png")


def machine(*arguments: str) -> contextlib.AbstractContextManager[str]:
    """Run a machine that is made for the tests."""
    return started(sys.executable, str(ROBOT), *arguments)


def viewer(*files: str) -> contextlib.AbstractContextManager[str]:
    """Run a viewer that may command; yields its address."""
    return started(*smachpy("view", "--child", "--control", "--port", "0", *files))


def main() -> None:
    """Make all pictures."""
    with (
        private_network(),
        tempfile.TemporaryDirectory() as folder,
        sync_playwright() as playwright,
    ):
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"]
        )
        look_at_patrol(browser, folder)
        look_at_preempt(browser)
        look_at_large(browser, 60, "viewer_sixty.png", dark=True)
        look_at_large(browser, 500, "viewer_big.png")
        look_at_goal(browser)
        browser.close()


if __name__ == "__main__":
    main()
