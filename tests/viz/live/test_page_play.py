"""The play bar: playing a run again, the clock, and jumps to what matters."""

from __future__ import annotations

import PIL.Image
import pytest

from tests.viz.live.test_page_layout import nested

pytestmark = pytest.mark.browser

SHOWN = "() => smachpy.store.clock.instantText(smachpy.store.playback.nowMs())"


def run():
    return [
        ("Started", "/JOB", {"at": 0.0}),
        ("Entered", "/JOB/A", {"at": 1.0}),
        ("UserdataWritten", "/JOB/A", {"key": "count", "value": 1, "at": 2.0}),
        ("PreemptRequested", "/JOB/A", {"source": "operator", "at": 10.0}),
        ("Left", "/JOB/A", {"outcome": "aborted", "at": 20.0}),
        ("Entered", "/JOB/B", {"at": 20.0}),
        ("UserdataWritten", "/JOB/B", {"key": "count", "value": 2, "at": 30.0}),
        ("Failed", "/JOB/B", {"error": "ValueError: x", "at": 40.0}),
        ("Finished", "/JOB", {"outcome": None, "at": 50.0}),
    ]


def freeze(page):
    """Let pictures of a run that is played come when the test asks for them."""
    page.evaluate(
        """() => { let moment = performance.now(); performance.now = () => moment;
          window.pass = (ms) => { moment += ms; smachpy.store.playback.playOn(moment); }; }"""
    )


def test_a_run_is_played_at_its_rate_to_its_end(served, look):
    served.add("one", events=run())
    page = look(served.start())
    freeze(page)
    page.click("#play")
    assert page.evaluate(SHOWN) == "00:00.0"
    page.wait_for_selector("#play[aria-label='hold the picture']")
    page.evaluate("() => pass(1500)")
    assert page.evaluate(SHOWN) == "00:01.5"
    page.select_option(".rate select", "64")
    page.evaluate("() => pass(250)")
    assert page.evaluate(SHOWN) == "00:17.5"
    page.keyboard.press(" ")
    page.evaluate("() => pass(5000)")
    assert page.evaluate(SHOWN) == "00:17.5"  # held
    page.keyboard.press(" ")
    page.select_option(".rate select", "0.25")
    page.evaluate("() => pass(2000)")
    assert page.evaluate(SHOWN) == "00:18.0"
    page.evaluate(
        "() => smachpy.store.playback.seek(smachpy.store.data.run.first() + 49000)"
    )  # plays on from there
    page.evaluate("() => pass(3000)")
    assert page.evaluate(SHOWN) == "00:49.8"
    page.evaluate("() => pass(2000)")
    assert page.evaluate(
        "() => [smachpy.store.playback.cursor.value, smachpy.store.playback.playing.value]"
    ) == [
        None,
        None,
    ]
    page.wait_for_selector("#play[aria-label='play']")


def test_a_live_run_is_held_and_becomes_live_again(served, look):
    machine = served.add("one", events=run()[:3])
    page = look(served.start())
    freeze(page)
    page.wait_for_selector("#play[aria-label='hold the picture']")
    page.click("#play")
    assert page.evaluate(SHOWN) == "00:02.0"
    page.wait_for_selector(".live-button[aria-pressed=false]")
    machine.add(served.events(run()[3:4], after=3))
    page.wait_for_function("() => smachpy.store.data.run.events.length === 4")
    assert page.evaluate(SHOWN) == "00:02.0"
    page.keyboard.press(" ")
    page.evaluate("() => pass(8500)")
    page.wait_for_selector(".live-button[aria-pressed=true]")


def test_the_clock_goes_while_a_run_goes_on(served, look):
    served.add("one", events=run()[:1])
    page = look(served.start())
    page.wait_for_selector(".clock input")
    before = page.input_value(".clock input")
    page.wait_for_function(
        "(before) => document.querySelector('.clock input').value > before", arg=before
    )


def test_keys_and_buttons_jump(served, look):
    served.add("one", events=run())
    page = look(served.start())
    at = []
    for key in ("Home", "f", "f", "F", "P", "Home", "k", "k", "K", "Home", "g"):
        page.keyboard.press(key)
        at.append(page.evaluate(SHOWN)[3:5])
    assert at == ["00", "20", "40", "20", "10", "00", "02", "30", "02", "00", "00"]
    page.wait_for_selector(".notice")  # there is no goal
    page.keyboard.press("End")
    assert page.evaluate("() => smachpy.store.playback.cursor.value") is None
    page.click(".jumps button:has-text('failure')")  # at the end the newest one is the next
    assert page.evaluate(SHOWN) == "00:40.0"
    page.wait_for_selector(".jumps button:has-text('failure')[aria-disabled=true]")
    page.click(".jumps button:has-text('preempt')", modifiers=["Shift"], force=True)
    assert page.evaluate(SHOWN) == "00:10.0"


def test_an_instant_is_typed(served, look):
    served.add("one", events=run())
    page = look(served.start())
    for text, shown in (("32.5", "00:32.5"), ("0:07", "00:07.0"), ("99:00", "00:50.0")):
        page.fill(".clock input", text)
        page.keyboard.press("Enter")
        assert page.evaluate(SHOWN) == shown
    page.fill(".clock input", "soon")
    page.keyboard.press("Enter")
    assert "got soon; expected" in page.text_content(".notice.error")
    assert page.evaluate(SHOWN) == "00:50.0"


def test_space_pauses_the_mission_only_where_one_looks_at_now(served, look):
    control = {"paused": False, "breakpoints": []}
    served.add("one", events=run()[:3], control=control)
    page = look(f"{served.start(token='t')}#token=t")
    page.wait_for_selector("#pause")
    page.keyboard.press(" ")
    page.wait_for_selector(".notice.info")
    page.evaluate("() => smachpy.store.playback.seek(smachpy.store.data.run.first())")
    page.keyboard.press(" ")
    page.wait_for_function("() => smachpy.store.playback.playing.value !== null")
    assert [one["command"] for one in served.commands] == ["pause"]


def test_the_bar_can_be_used_on_a_phone(served, look):
    served.add("one", events=run())
    page = look(served.start())
    page.set_viewport_size({"width": 390, "height": 844})
    box = page.query_selector("#play").bounding_box()
    assert min(box["width"], box["height"]) >= 40
    assert box["y"] + box["height"] <= 844
    page.click("#play")
    page.wait_for_function("() => smachpy.store.playback.playing.value !== null")


KEY = """() => { const select = document.querySelector(".jumps select"), style = getComputedStyle(select);
    const paper = document.createElement("canvas").getContext("2d");
    paper.font = style.font;
    const arrow = 16; // of the browser
    const room = select.clientWidth - parseFloat(style.paddingLeft) - parseFloat(style.paddingRight) - arrow;
    return room - paper.measureText(select.selectedOptions[0].text).width; }"""


@pytest.mark.parametrize("size", [(1440, 900), (1024, 768), (390, 844), (844, 390)])
def test_a_short_name_of_a_key_is_shown_whole(served, look, size):
    served.add("one", events=run())
    page = look(served.start(), viewport={"width": size[0], "height": size[1]})
    page.wait_for_selector(".jumps select:has-text('count')")
    assert page.evaluate(KEY) >= 0


def at(page, seconds, lane=10):
    """Where an instant is in the timeline."""
    return page.evaluate(
        """([s, y]) => { const { canvas, scale } = smachpy.page.timeline, b = canvas.getBoundingClientRect();
          return [b.left + scale.x(smachpy.store.data.run.first() + 1000 * s), b.top + y]; }""",
        [seconds, lane],
    )


def drag(page, begin, end):
    page.mouse.move(*begin)
    page.mouse.down()
    page.mouse.move(*[(a + b) / 2 for a, b in zip(begin, end, strict=True)])
    page.mouse.move(*end)
    page.mouse.up()


STRETCH = """() => { const { data, playback } = smachpy.store, stretch = playback.stretch.value;
  return stretch && [stretch.from, stretch.to].map((t) => Math.round((t - data.run.first()) / 1000)); }"""


def test_a_drag_over_the_lanes_selects_what_is_looped(served, look):
    served.add("one", events=run())
    page = look(served.start())
    page.evaluate("() => { smachpy.page.timeline.window.fitAll(); smachpy.page.timeline.draw(); }")
    freeze(page)
    drag(page, at(page, 12), at(page, 22))
    assert page.evaluate(STRETCH) == [12, 22]
    assert page.evaluate("() => smachpy.store.playback.cursor.value") is None  # it moves nothing
    page.evaluate(
        "() => { const { from, to } = smachpy.store.playback.stretch.value; smachpy.store.playback.selectStretch(from - from % 1, to); }"
    )
    page.click("#loop")
    page.wait_for_selector("#loop[aria-pressed=true]")
    first = page.evaluate(SHOWN)
    assert first.startswith("00:1")
    length = page.evaluate(
        "() => smachpy.store.playback.stretch.value.to - smachpy.store.playback.stretch.value.from"
    )
    page.evaluate("(ms) => pass(ms - 1000)", length)
    assert page.evaluate(SHOWN) != first
    page.evaluate("() => pass(1000)")
    assert page.evaluate(SHOWN) == first  # begins anew
    page.keyboard.press("r")
    page.wait_for_selector("#loop[aria-pressed=false]")
    page.evaluate("(ms) => pass(ms + 2000)", length)
    assert page.evaluate(STRETCH) == [12, 22]
    page.keyboard.press("Escape")
    assert page.evaluate(STRETCH) is None


def test_a_drag_on_the_axis_moves_the_instant(served, look):
    served.add("one", events=run())
    page = look(served.start())
    page.evaluate("() => { smachpy.page.timeline.window.fitAll(); smachpy.page.timeline.draw(); }")
    axis = page.evaluate("() => smachpy.page.timeline.canvas.clientHeight - 8")
    drag(page, at(page, 12, axis), at(page, 22, axis))
    assert page.evaluate(SHOWN).startswith("00:22")
    assert page.evaluate(STRETCH) is None


def test_only_the_first_button_moves_the_instant_and_the_wheel_zooms_at_once(served, look):
    served.add("one", events=run())
    page = look(served.start())
    page.evaluate("() => { smachpy.page.timeline.window.fitAll(); smachpy.page.timeline.draw(); }")
    axis = page.evaluate("() => smachpy.page.timeline.canvas.clientHeight - 8")
    page.mouse.click(*at(page, 12, axis), button="right")
    assert page.evaluate("() => smachpy.store.playback.cursor.value") is None
    shorter = """() => { const { timeline } = smachpy.page, { from, to } = timeline.scale;
      timeline.canvas.dispatchEvent(new WheelEvent("wheel",
        { deltaY: -100, clientX: timeline.canvas.getBoundingClientRect().left + 300, cancelable: true }));
      return timeline.scale.to - timeline.scale.from < to - from; }"""
    assert page.evaluate(shorter)


def test_the_axis_tells_instants_as_the_clock_does(served, look):
    served.add("one", events=run())
    page = look(served.start())
    texts = """() => { const { timeline } = smachpy.page, { prototype } = CanvasRenderingContext2D,
      texts = [], before = prototype.fillText;
      prototype.fillText = function (text, ...place) { texts.push(text); before.call(this, text, ...place); };
      for (const end of [50, 1]) { timeline.window.length = 1000 * end; timeline.window.end = smachpy.store.data.run.first() + 1000 * end;
        timeline.draw(); }
      prototype.fillText = before; return texts.filter((text) => /[0-9]/.test(text)); }"""
    told = page.evaluate(texts)
    assert {"00:10", "00:40", "00:00.2", "00:00.8"} <= set(told)


def test_the_stretch_is_chosen_by_keys_by_the_selected_state_and_by_a_link(served, look):
    served.add("one", events=run())
    page = look(served.start())
    page.evaluate("() => smachpy.store.playback.seek(smachpy.store.data.run.first() + 5000)")
    page.keyboard.press("[")
    page.evaluate("() => smachpy.store.playback.seek(smachpy.store.data.run.first() + 15000)")
    page.keyboard.press("]")
    assert page.evaluate(STRETCH) == [5, 15]
    page.evaluate("() => smachpy.store.playback.seek(smachpy.store.data.run.first() + 2000)")
    page.keyboard.press("]")  # it would end before it begins
    assert page.evaluate(STRETCH) == [5, 15]
    address = page.evaluate("() => smachpy.page.address.text")
    page.goto("about:blank")
    page.goto(address)
    page.wait_for_selector("html[data-drawn]")
    assert page.evaluate(STRETCH) == [5, 15]
    page.keyboard.press("Escape")
    page.evaluate(
        "() => { smachpy.page.select('/JOB/B'); smachpy.store.playback.seek(smachpy.store.data.run.first() + 30000); }"
    )
    page.keyboard.press("r")
    assert page.evaluate(STRETCH) == [20, 40]


def test_the_last_seconds_are_saved_as_a_gif_without_moving_anything(served, look, tmp_path):
    served.add("one", events=run())
    page = look(served.start())
    page.evaluate(
        "() => { const { store } = smachpy; store.playback.seek(store.data.run.first() + 30000);"
        " store.playback.selectStretch(store.data.run.first() + 19000, store.data.run.first() + 21000);"
        " store.playback.togglePlaying(); store.playback.seek(store.data.run.first() + 30000); }"
    )
    with page.expect_download() as download:
        page.click(".share button:has-text('GIF')")
    assert (
        page.evaluate("() => smachpy.store.playback.playing.value") is None
    )  # pictures are of one instant
    assert download.value.suggested_filename.startswith("JOB-00-3")
    download.value.save_as(tmp_path / "run.gif")
    film = (tmp_path / "run.gif").read_bytes()
    assert film[:6] == b"GIF89a"
    width, height = (int.from_bytes(film[at : at + 2], "little") for at in (6, 8))
    assert 300 < width <= 960
    assert height > 100
    assert 2 < film.count(b"\x21\xf9\x04") <= 11  # 5 pictures a second, fewer where nothing changes
    page.wait_for_selector(".share button:has-text('GIF'):enabled")
    assert page.evaluate(SHOWN).startswith("00:3")


PLAYED = """async (bytes) => {
  const film = document.createElement('video');
  film.muted = true;
  film.src = URL.createObjectURL(new Blob([Uint8Array.from(bytes)], { type: 'video/mp4' }));
  const told = (name) => new Promise((done, failed) => {
    film.addEventListener(name, done, { once: true });
    film.addEventListener('error', () => failed(new Error(film.error.message)), { once: true }); });
  await told('loadeddata');
  const canvas = new OffscreenCanvas(film.videoWidth, film.videoHeight), g = canvas.getContext('2d');
  const pictures = [];
  for (const t of [0.1, film.duration - 0.1]) {
    const shown = told('seeked');
    film.currentTime = t;
    await shown;
    g.drawImage(film, 0, 0);
    pictures.push([...g.getImageData(0, 0, canvas.width, canvas.height).data].join());
  }
  return [film.videoWidth, film.videoHeight, film.duration, pictures[0] === pictures[1]]; }"""


def test_a_video_of_the_selected_stretch_plays_in_the_browser(served, look, tmp_path):
    served.add("one", events=run())
    page = look(served.start())
    page.evaluate(
        "() => { const { store } = smachpy;"
        " store.playback.selectStretch(store.data.run.first() + 19000, store.data.run.first() + 21000); }"
    )
    with page.expect_download() as download:
        page.click(".share button:text-is('Video')")
    assert download.value.suggested_filename.endswith(".mp4")
    download.value.save_as(tmp_path / "run.mp4")
    film = (tmp_path / "run.mp4").read_bytes()
    assert film[4:8] == b"ftyp"
    blank = page.context.new_page()  # our page plays nothing: its policy forbids it
    width, height, seconds, is_still = blank.evaluate(PLAYED, list(film))
    assert 300 < width <= 960
    assert height > 100
    assert seconds == pytest.approx(2.2)  # eleven pictures, five a second
    assert not is_still  # /JOB/B begins on the way
    page.wait_for_selector(".share button:text-is('Video')")


def test_where_the_browser_encodes_no_video_only_a_gif_is_offered(served, look):
    """Over http, from another computer, browsers have no encoder."""
    served.add("one", events=run())
    page = look(served.start())
    page.wait_for_selector(".share button:text-is('Video')")
    page.add_init_script("delete window.VideoEncoder;")
    page.reload()
    page.wait_for_selector(".share button:text-is('GIF')")
    assert not page.query_selector(".share button:text-is('Video')")


def test_a_film_of_a_large_machine_has_its_tiles_without_an_image_of_all_elements(
    served, look, tmp_path
):
    """An image of thousands of elements took seconds for each picture."""
    moves = [("Started", "/TOP"), ("Entered", "/TOP/S3"), ("Entered", "/TOP/S3/S7")]
    later = [
        ("Entered", "/TOP/S3/S7/S5", {"at": 2.0}),
        ("Left", "/TOP/S3/S7/S5", {"outcome": "done", "at": 4.0}),
    ]
    served.add("big", sm=nested(10, 2), events=[*moves, *later])
    page = look(served.start())
    page.evaluate(
        """() => { const { page, store } = smachpy, { prototype } = Image, real = prototype.decode;
          window.images = 0; window.told = new Set();
          prototype.decode = function () { window.images += 1; return real.call(this); };
          store.playback.filmed.subscribe((part) => window.told.add(part));
          store.playback.selectStretch(store.data.run.first() + 1000, store.data.run.first() + 3000);
          page.layouts.setDepth(99); return page.layouts.running; }"""
    )
    with page.expect_download() as download:
        page.click(".share button:has-text('GIF')")
    download.value.save_as(tmp_path / "run.gif")
    images, told = page.evaluate("() => [window.images, [...window.told]]")
    assert images == 0
    assert len([part for part in told if part and part < 100]) > 5  # it told how far it was
    x, y = page.evaluate(
        """() => { const { diagram, map, view: { x, y, k } } = smachpy.page;
          const box = diagram.boxOf("/TOP/S3/S7/S5"), part = Math.min(1, 960 / (diagram.svg.clientWidth + map.canvas.clientWidth));
          return [(x + (box.x + box.w / 8) * k) * part, (32 + y + (box.y + box.h / 2) * k) * part].map(Math.round); }"""
    )
    with PIL.Image.open(tmp_path / "run.gif") as film:
        colours = []
        for number in (0, film.n_frames - 1):
            film.seek(number)
            colours.append(film.convert("RGB").getpixel((x, y)))
    assert colours[0] != colours[1]  # the state runs in the last one


def test_a_film_can_be_stopped_and_freezes_nothing(served, look):
    served.add("one", events=run())
    page = look(served.start())
    page.evaluate(
        "() => { const { store } = smachpy; store.playback.selectStretch(store.data.run.first(), store.data.run.last()); }"
    )
    downloads = []
    page.on("download", lambda one: downloads.append(one))
    page.evaluate(
        """() => { const { prototype } = Image, real = prototype.decode, held = new Promise((go) => { window.goOn = go; });
          prototype.decode = function () { return held.then(() => real.call(this)); }; }"""
    )
    page.click(".share button:has-text('GIF')")
    page.click(".share button:has-text('%')")  # it takes clicks while it encodes
    page.evaluate("() => goOn()")
    page.wait_for_selector(".share button:text-is('GIF')")
    assert page.evaluate("() => smachpy.store.playback.filmed.value") is None
    assert downloads == []


def test_what_is_typed_stays_while_a_run_goes_on(served, look):
    served.add("one", events=run()[:1])
    page = look(served.start())
    page.click(".clock input")
    page.keyboard.type("0:0")
    shown = ".clock small"  # the length of the run, drawn together with the instant
    before = page.text_content(shown)
    page.wait_for_function(
        "([shown, before]) => document.querySelector(shown).textContent !== before",
        arg=[shown, before],
    )
    assert page.input_value(".clock input") == "0:0"
    page.keyboard.press("Enter")
    assert page.evaluate(SHOWN) == "00:00.0"
