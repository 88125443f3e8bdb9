"""Make patrol_page.gif, the live page during a patrol, from a recorded run.

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
from playwright.sync_api import sync_playwright

IMAGES = Path(__file__).parent
SIZE = {"width": 1200, "height": 750}
WIDTH = 800  # of the picture [pixels]
EVERY = 2000  # of the run [ms]
FRAME = 250  # of the picture [ms]
SEEK = "(ms) => smachpy.store.playback.seek(smachpy.store.data.run.first() + ms)"
LENGTH = "() => smachpy.store.data.run.last() - smachpy.store.data.run.first()"


def smachpy(*arguments: str) -> list[str]:
    """Return a command."""
    return [sys.executable, "-m", "smachpy", *arguments]


def frames_of(address: str) -> list[Image.Image]:
    """Return pictures of the page, an instant of the run each."""
    frames = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"]
        )
        page = browser.new_page(viewport=SIZE)
        page.goto(address)
        page.wait_for_selector("#play")
        page.wait_for_timeout(3000)  # the layout, and the map
        length = int(page.evaluate(LENGTH))
        for instant in range(500, length, EVERY):
            page.evaluate(SEEK, instant)
            page.wait_for_timeout(150)
            picture = Image.open(io.BytesIO(page.screenshot()))
            height = WIDTH * SIZE["height"] // SIZE["width"]
            frames.append(picture.convert("RGB").resize((WIDTH, height), Image.Resampling.LANCZOS))
        browser.close()
    return frames


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
            frames = frames_of(line[line.index("http://") :].split()[0])
        finally:
            view.terminate()
            view.wait()
    palette = frames[len(frames) // 2].quantize(96, dither=Image.Dither.NONE)
    pictures = [f.quantize(palette=palette, dither=Image.Dither.NONE) for f in frames]
    file = IMAGES / "patrol_page.gif"
    pictures[0].save(
        file, save_all=True, append_images=pictures[1:], duration=FRAME, loop=0, optimize=True
    )
    print(f"{file}: {len(pictures)} pictures, {file.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
