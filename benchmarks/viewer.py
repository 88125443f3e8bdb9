"""What the live page costs: frames, time from an event to its paint, the server's processor time.

    python benchmarks/viewer.py [--states N] [--depth N] [--rate HZ] [--seconds S] [--json]
    python benchmarks/viewer.py --recorded EVENTS [--json]

A mission in another process, `smachpy view` in a third, a headless Chromium that draws in software.
Hold at 50 transitions/s: 50 frames/s, p95 from event to paint 80 ms, 5 % of a core per client.
With --recorded, a recorded run with that many events is opened, and 100 instants of it are shown.
Figures mean something only on a machine that does nothing else.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from playwright.sync_api import sync_playwright

import smachpy
from smachpy.events.recording import Recorder

ROBOT = Path(__file__).parent.parent / "tests" / "viz" / "live" / "robot.py"
TICKS = os.sysconf("SC_CLK_TCK")


def start(*command):
    child = subprocess.Popen(
        [sys.executable, *map(str, command)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    return child, child.stdout.readline().strip()


def launch(playwright):
    return playwright.chromium.launch(
        executable_path=shutil.which("chromium"),
        args=["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"],
    )


def processor_time(pid):
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def quantile(values, share):
    ordered = sorted(values)
    return ordered[min(int(share * len(ordered)), len(ordered) - 1)]


def measure(page, pid, seconds):
    page.evaluate("""() => {
        smachpy.page.scheduler.latency.measured.length = 0; window.frames_ = 0; window.go_ = true;
        const frame = () => { window.frames_ += 1; if (window.go_) requestAnimationFrame(frame); };
        requestAnimationFrame(frame);
        window.from_ = smachpy.store.data.run.events.length;
    }""")
    cpu, begun = processor_time(pid), time.perf_counter()
    page.wait_for_timeout(seconds * 1000)
    took = time.perf_counter() - begun
    frames, latencies, events, left = page.evaluate("""() => { window.go_ = false;
        const fresh = smachpy.store.data.run.events.slice(window.from_);
        return [window.frames_, smachpy.page.scheduler.latency.measured, fresh.length,
            fresh.filter((e) => e.kind === "Left").length]; }""")
    cpu = (processor_time(pid) - cpu) / took
    print(
        f"{left / took:6.1f} transitions/s, {events / took:6.1f} events/s: "
        f"{frames / took:5.1f} frames/s, event to paint p50 {quantile(latencies, 0.5):5.1f} ms "
        f"p95 {quantile(latencies, 0.95):5.1f} ms, "
        f"server {cpu:5.1%} of a core",
        file=sys.stderr,
    )
    return {
        "frames/s": frames / took,
        "event to paint p95 ms": quantile(latencies, 0.95),
        "server: CPU s per s": cpu,
    }


def record(path, events):
    """Record a machine of two states that goes on until so many events are made."""
    left = [events // 4]

    def step(_):
        left[0] -= 1
        return "again" if left[0] > 0 else "done"

    machine = smachpy.StateMachine(["done"], name="LOOP")
    machine.add("A", smachpy.CBState(lambda _: "done", outcomes=["done"]), {"done": "B"})
    machine.add("B", smachpy.CBState(step, outcomes=["again", "done"]), {"again": "A"})
    with Recorder(path, machine):
        machine.execute()


def busy(session):
    """Return the processor time of the tasks of the page's main thread [s]."""
    metrics = session.send("Performance.getMetrics")["metrics"]
    return next(one["value"] for one in metrics if one["name"] == "TaskDuration")


def look_at_recorded(browser, folder, events):
    """Open a recorded run, and look at instants of it."""
    path = Path(folder) / "run.jsonl"
    record(path, events)
    view, address = start("-m", "smachpy.command", "view", "--child", "--port", 0, path)
    try:
        page = browser.new_page(viewport={"width": 1600, "height": 950})
        session = page.context.new_cdp_session(page)
        session.send("Performance.enable", {"timeDomain": "threadTicks"})  # CPU, not the clock
        cpu, begun = processor_time(view.pid), time.perf_counter()
        page.goto(address)
        page.wait_for_selector("html[data-drawn]", timeout=120_000)
        figures = {
            "recorded: opened s": time.perf_counter() - begun,
            "recorded: server CPU s": processor_time(view.pid) - cpu,
            "recorded: page CPU s": busy(session),
        }
        shown = page.evaluate("() => smachpy.store.data.run.events.length")
        before = busy(session)
        page.evaluate("""async () => {
            const { data: { run }, playback } = smachpy.store;
            for (let i = 0; i < 100; i++) {
                playback.seek(run.first() + ((run.last() - run.first()) * ((37 * i) % 100)) / 100);
                await new Promise((done) => requestAnimationFrame(done));
            } }""")
        figures["recorded: page CPU ms per instant"] = 10 * (busy(session) - before)
        print(f"{shown} events of {events} in the page", file=sys.stderr)
        for name, value in figures.items():
            print(f"{name}: {value:.2f}", file=sys.stderr)
        return figures
    finally:
        view.stdin.close()
        view.wait(10)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--states", type=int, default=60)
    parser.add_argument("--depth", type=int, default=99)
    parser.add_argument("--rate", type=float, default=30.0)
    parser.add_argument("--seconds", type=float, default=6.0)
    parser.add_argument("--recorded", type=int, default=0)
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    os.environ.setdefault("SMACHPY_DOMAIN", str(1 + os.getpid() % 9999))
    if args.recorded:
        with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
            browser = launch(playwright)
            figures = look_at_recorded(browser, folder, args.recorded)
            browser.close()
        if args.json:
            print(json.dumps(figures))
        return
    robot, _ = start(ROBOT, "--states", args.states, "--rate", args.rate)
    view, address = start("-m", "smachpy.command", "view", "--child", "--port", 0)
    try:
        found = re.match(r"http://[^#]*", address)
        assert found, address
        with sync_playwright() as playwright:
            browser = launch(playwright)
            page = browser.new_page(viewport={"width": 1600, "height": 950})
            begun = time.perf_counter()
            page.goto(found[0] + "?machine=robot")
            page.wait_for_selector(".diagram g[data-path]", timeout=60_000)
            first = time.perf_counter() - begun
            page.wait_for_selector("html[data-drawn]", timeout=60_000)
            drawn = time.perf_counter() - begun
            page.evaluate(
                f"async () => {{ smachpy.page.layouts.setDepth({args.depth});"
                " await smachpy.page.layouts.running; }"
            )
            page.wait_for_timeout(1000)
            shown = page.evaluate("() => document.querySelectorAll('.diagram *').length")
            print(
                f"{args.states} states, {shown} elements; first picture after {first:.1f} s, its "
                f"arrows after {drawn:.1f} s",
                file=sys.stderr,
            )
            figures = {"first picture s": first, "arrows s": drawn}
            figures |= measure(page, view.pid, args.seconds)
            page.evaluate("() => smachpy.page.layouts.setFollow(true)")
            page.wait_for_timeout(1000)
            print("following:", file=sys.stderr)
            measure(page, view.pid, args.seconds)
            browser.close()
            if args.json:
                print(json.dumps(figures))
    finally:
        for child in (robot, view):
            child.stdin.close()
            child.wait(10)


if __name__ == "__main__":
    main()
