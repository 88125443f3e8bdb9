"""Where the page puts things: grids, folded chains, the overview, what is followed."""

from __future__ import annotations

import pytest

from smachpy import CBState, Concurrence, StateMachine
from tests.browser import wait_for

pytestmark = pytest.mark.browser


def chain(names, of=None, name=None):
    """States one after the other; `of(name)` makes each."""
    sm = StateMachine(outcomes=["done"], **({} if name is None else {"name": name}))
    with sm:
        for one, after in zip(names, [*names[1:], "done"], strict=True):
            state = of(one) if of else CBState(lambda _: "done", outcomes=["done"])
            StateMachine.add(one, state, {"done": after})
    return sm


def nested(width, depth):
    names = [f"S{n}" for n in range(width)]
    return chain(names, None if depth == 0 else lambda _: nested(width, depth - 1), "TOP")


def regions(count):
    fleet = Concurrence(outcomes=["done"], default_outcome="done", name="FLEET")
    with fleet:
        for n in range(count):
            Concurrence.add(f"ROBOT_{n}", chain(["NEXT", "DRIVE", "PARK"]))
    return fleet


def all_levels(page):
    page.evaluate(
        "() => { smachpy.page.layouts.setDepth(99); return smachpy.page.layouts.running; }"
    )
    return page.evaluate(
        """() => { const { page } = smachpy; return { size: page.diagram.size, k: page.view.k,
        stage: page.view.width / page.view.height, boxes: Object.fromEntries(page.diagram.picture.boxes) }; }"""
    )


def fills(shown):
    """How far the drawing's aspect is from the view's; 1 is the same."""
    aspect = shown["size"]["w"] / shown["size"]["h"]
    return max(aspect / shown["stage"], shown["stage"] / aspect)


def test_independent_regions_stand_in_a_grid(served, look):
    served.add("fleet", sm=regions(8))
    shown = all_levels(look(served.start()))
    robots = [shown["boxes"][f"/FLEET/ROBOT_{n}"] for n in range(8)]
    assert len({round(box["y"]) for box in robots}) in {2, 3, 4}  # rows
    assert fills(shown) < 2


def test_a_long_chain_is_folded(served, look):
    served.add("chain", sm=chain([f"STEP_{n}" for n in range(53)], name="CHAIN"))
    shown = all_levels(look(served.start()))
    assert fills(shown) < 2
    assert shown["k"] > 0.5


def recovery():
    """What drives, chooses what to do when it fails, and goes back: arrows over several lines."""
    turn = chain(["HALF", "OTHER_HALF"])
    turn.register_outcomes(["aborted"])
    ways = {
        "REMEMBER": {"valid": "DRIVE", "invalid": "aborted"},
        "DRIVE": {"succeeded": "succeeded", "aborted": "CHOOSE"},
        "CHOOSE": {"clear": "CLEAR", "rotate": "ROTATE", "ask": "ASK"},
        "CLEAR": {"succeeded": "DRIVE", "aborted": "CHOOSE"},
        "ROTATE": {"done": "DRIVE", "aborted": "CHOOSE"},
        "ASK": {
            "retry": "CLEAR",
            "home": "COME_BACK",
            "give_up": "aborted",
            "no_answer": "COME_BACK",
        },
        "COME_BACK": {"succeeded": "returned"},
    }
    sm = StateMachine(outcomes=["succeeded", "returned", "aborted"], name="RECOVERY")
    with sm:
        for name, way in ways.items():
            state = turn if name == "ROTATE" else CBState(lambda _: "x", outcomes=list(way))
            StateMachine.add(name, state, way)
    return sm


ROOTS = """() => {
    const { view, layouts: { layout } } = smachpy.page;
    const roots = [...layout.cache.values()].filter((one) => one.node.parent === null);
    const arrows = roots.flatMap((root) => root.edges.map((edge) => edge.points));
    const isStraight = (points) => points.every((p, i) =>
        i === 0 || Math.min(Math.abs(p.x - points[i - 1].x), Math.abs(p.y - points[i - 1].y)) < 1);
    return { scales: roots.map((one) => view.scaleFor(one)), straight: arrows.every(isStraight) };
}"""


@pytest.mark.parametrize("size", [(1440, 900), (1024, 768), (390, 844)])
def test_of_the_layouts_the_one_with_about_the_largest_scale_is_shown(served, look, size):
    served.add("recovery", sm=recovery())
    page = look(served.start())
    page.set_viewport_size(dict(zip(("width", "height"), size, strict=True)))
    shown = all_levels(page)
    tried = page.evaluate(ROOTS)
    assert tried["straight"]
    assert shown["k"] >= 0.85 * min(1.5, max(tried["scales"]))


def test_a_chain_in_a_machine_is_folded_though_nothing_leads_to_one_of_its_outcomes(served, look):
    work = chain([f"STEP_{n}" for n in range(24)])
    work.register_outcomes(["preempted"])
    top = StateMachine(outcomes=["done", "preempted"], name="TOP")
    with top:
        StateMachine.add("WORK", work, {"done": "done", "preempted": "preempted"})
    served.add("work", sm=top)
    page = look(served.start())
    said = []
    page.on("console", lambda message: said.append(message.text))
    all_levels(page)
    assert said == []


def test_heat_has_a_scale_that_is_seen(served, look):
    served.add("chain", sm=chain(["A", "B"], name="CHAIN"))
    page = look(served.start())
    all_levels(page)
    assert page.locator(".legend .scale").count() == 0
    page.evaluate("() => smachpy.page.setNumbers('time')")
    scale = page.locator(".legend .scale")
    scale.wait_for()
    assert scale.inner_text().startswith("0 s")
    assert scale.locator(".heat").bounding_box()["width"] >= 40


def test_levels_lay_out_anew_for_the_view(served, look):
    served.add("chain", sm=chain([f"STEP_{n}" for n in range(24)], name="CHAIN"))
    page = look(served.start())
    wide = all_levels(page)
    page.set_viewport_size({"width": 760, "height": 1400})
    wait_for(page, "smachpy.page.view.width < smachpy.page.view.height")
    narrow = all_levels(page)
    assert narrow["size"]["w"] / narrow["size"]["h"] < wide["size"]["w"] / wide["size"]["h"]
    assert fills(narrow) < 2.5


def test_too_many_states_for_arrows_are_tiles_where_the_running_ones_are_lit(served, look):
    sm = nested(10, 2)
    path = "/TOP/S3/S7/S5"
    parts = [path.rsplit("/", cut)[0] for cut in (3, 2, 1)] + [path]
    served.add("big", sm=sm, events=[("Started", "/TOP"), *(("Entered", p) for p in parts[1:])])
    page = look(served.start())
    shown = all_levels(page)
    assert page.evaluate("() => smachpy.store.view.overview.value")
    assert len(shown["boxes"]) == 1111
    assert fills(shown) < 1.6
    assert page.evaluate(f"() => !!document.querySelector('g.leaf.active[data-path=\"{path}\"]')")
    tiles = [shown["boxes"][f"/TOP/S3/S{n}"] for n in range(10)]
    for i, a in enumerate(tiles):
        for b in tiles[:i]:
            aside = a["x"] >= b["x"] + b["w"] or b["x"] >= a["x"] + a["w"]
            assert aside or a["y"] >= b["y"] + b["h"] or b["y"] >= a["y"] + a["h"]
    again = all_levels(page)
    assert again["boxes"] == shown["boxes"]
    page.dblclick(f'g[data-path="{path}"] .frame', force=True)  # its diagram, there
    wait_for(page, "!smachpy.store.view.overview.value && !smachpy.page.layouts.running")
    assert page.evaluate(f"() => smachpy.page.diagram.picture.boxes.has('{path}')")
    assert page.locator("path.edge").count() > 5
    page.keyboard.press("9")  # and back
    wait_for(page, "smachpy.store.view.overview.value")


def test_many_branches_are_cards_and_one_bracket_counts_them(served, look):
    labels = [f"ROBOT_{n}" for n in range(8)]
    fleet = Concurrence(
        outcomes=["done", "stuck"],
        default_outcome="stuck",
        outcome_map={"done": dict.fromkeys(labels, "done")},
        name="FLEET",
    )
    with fleet:
        for label in labels:
            Concurrence.add(label, CBState(lambda _: "done", outcomes=["done"]))
    begun = [("Entered", f"/FLEET/{label}") for label in labels]
    left = [("Left", f"/FLEET/{label}", {"outcome": "done"}) for label in labels[:3]]
    served.add(
        "fleet", sm=fleet, events=[("Started", "/FLEET"), ("Entered", "/FLEET"), *begun, *left]
    )
    page = look(served.start())
    assert page.locator("g.leaf.card").count() == 8
    assert page.locator(".diagram rect.join").count() == 1
    wait_for(page, "document.querySelector('.label.joined').textContent.includes('3 of 8')")
    assert page.locator("g.leaf.card.active").count() == 5


def test_transitions_of_many_states_to_one_outcome_are_told_there_with_their_number(served, look):
    sm = StateMachine(outcomes=["done", "failed"], name="JOB")
    names = [f"STEP_{n}" for n in range(8)]
    with sm:
        for one, after in zip(names, [*names[1:], "done"], strict=True):
            state = CBState(lambda _: "ok", outcomes=["ok", "failed"])
            StateMachine.add(one, state, {"ok": after, "failed": "failed"})
    served.add("one", sm=sm)
    page = look(served.start())
    all_levels(page)
    told = page.locator(".pill text").all_text_contents()
    assert sorted(told) == ["done", "failed, from 8"]
    assert page.locator("path.edge.failure").count() == 0
    assert page.locator("path.edge").count() == 9  # the beginning, and what leads on


def linked(count):
    """States of which each leads to each."""
    outcomes = [f"to {n}" for n in range(count)]
    sm = StateMachine(outcomes=["done"], name="LINKED")
    with sm:
        for n in range(count):
            state = CBState(lambda _: "done", outcomes=outcomes)
            StateMachine.add(f"S{n}", state, {f"to {m}": f"S{m}" for m in range(count)})
    return sm


@pytest.mark.parametrize(("count", "tiles"), [(8, False), (12, True), (40, True)])
def test_states_that_all_lead_to_each_other_are_drawn_in_time(served, look, count, tiles):
    served.add("linked", sm=linked(count))
    page = look(served.start())
    assert page.locator("g.leaf").count() == count
    assert page.evaluate("() => smachpy.store.view.overview.value") is tiles
    assert (page.locator("path.edge").count() >= count * count) is not tiles


@pytest.mark.parametrize("count", [8, 100, 1000])
def test_each_branch_of_a_concurrence_has_its_bar_however_many_they_are(served, look, count):
    fleet = Concurrence(outcomes=["done"], default_outcome="done", name="FLEET")
    with fleet:
        for n in range(count):
            Concurrence.add(f"R{n}", CBState(lambda _: "done", outcomes=["done"]))
    paths = [f"/FLEET/R{n}" for n in range(count)]
    events = [("Started", "/FLEET"), *(("Entered", path) for path in paths)]
    served.add("fleet", sm=fleet, events=events)
    page = look(served.start())  # an error in the page fails the test
    bars = page.evaluate(
        "() => { const { timeline } = smachpy.page; timeline.draw();"
        " return timeline.bars.hits.filter((one) => one.span.path !== '/FLEET'); }"
    )
    assert {bar["span"]["path"] for bar in bars} == set(paths)
    tops = [bar["top"] for bar in sorted(bars, key=lambda bar: paths.index(bar["span"]["path"]))]
    assert tops == sorted(tops)
    assert min(bar["bottom"] - bar["top"] for bar in bars) > 0.99


def test_follow_frames_all_that_runs_and_never_below_nine_pixels(served, look):
    running = [
        ("Entered", path)
        for n in range(24)
        for path in (f"/FLEET/ROBOT_{n}", f"/FLEET/ROBOT_{n}/DRIVE")
    ]
    served.add("fleet", sm=regions(24), events=[("Started", "/FLEET"), *running])
    page = look(served.start(follow=True))
    wait_for(
        page,
        "smachpy.store.view.follow.value && !smachpy.page.layouts.running && smachpy.page.view.k > 0.8",
    )
    # Each running state, or what it is folded into, is in view and legible.
    wait_for(
        page,
        """(() => { const { view, diagram } = smachpy.page, all = [...Array(24).keys()];
        const active = all.map((n) => diagram.boxOf(`/FLEET/ROBOT_${n}/DRIVE`) ?? diagram.boxOf(`/FLEET/ROBOT_${n}`));
        return view.k * 11 >= 9 && active.every((b) => b &&
          b.x * view.k + view.x > -1 && (b.x + b.w) * view.k + view.x < view.width + 1 &&
          b.y * view.k + view.y > -1 && (b.y + b.h) * view.k + view.y < view.height + 1); })()""",
    )


def test_a_shape_at_which_the_layouter_fails_is_left_out(served, look):
    served.add("one", labels="ABCD", events=[("Started", "/JOB"), ("Entered", "/JOB/A")])
    page = look(served.start())
    drawn = page.evaluate(
        """async () => { const { page } = smachpy, { elk } = page.layouts.layout, real = elk.layout.bind(elk), seen = [];
          elk.layout = async (graph) => {
            const all = graph.children.map((one) => one.layoutOptions["elk.direction"]);
            seen.push(...all);
            if (all.includes("DOWN")) throw new Error("Index: -1, Size: 0");
            return real(graph);
          };
          page.layouts.layout.clear();
          await page.layouts.relayout({ frame: true });
          return [seen.includes("DOWN"), [...page.layouts.layout.chosen.values()][0], smachpy.store.data.failure.value,
            document.querySelectorAll('g.leaf').length]; }"""
    )
    assert drawn[0]
    assert drawn[1].startswith("RIGHT")
    assert drawn[2:] == [None, 4]


def test_what_is_drawn_stays_when_nothing_can_be_laid_out(served, look):
    served.add("one", labels="ABCD", events=[("Started", "/JOB"), ("Entered", "/JOB/A")])
    page = look(served.start())
    page.evaluate(
        """async () => { const { page } = smachpy;
          page.layouts.layout.elk.layout = async () => { throw new Error("Index: -1, Size: 0"); };
          page.layouts.layout.clear(); await page.layouts.relayout({ frame: true }); }"""
    )
    assert page.locator("g.leaf").count() == 4
    page.wait_for_selector(".notice.error:has-text('could not be laid out')")


HELD_ELK = """{
  const Real = Worker, held = [];
  window.release = () => { for (const go of held.splice(0)) go(); window.release = null; };
  window.Worker = class extends Real {
    postMessage(...told) { window.release ? held.push(() => super.postMessage(...told)) : super.postMessage(...told); }
  };
}"""


def test_the_states_are_there_before_the_arrows_are_laid_out(served, look):
    """The layout's worker takes seconds to start on a busy computer: the diagram was empty."""
    served.add("one", labels="AB", events=[("Started", "/JOB"), ("Entered", "/JOB/A")])
    page = look("about:blank", drawn=False)
    page.add_init_script(HELD_ELK)
    page.goto(served.start())
    page.wait_for_selector("g.active[data-path='/JOB/A']")
    page.click("g[data-path='/JOB/B']")
    assert page.locator("path.edge").count() == 0
    assert page.query_selector("html[data-drawn]") is None
    page.evaluate("() => release()")
    page.wait_for_selector("html[data-drawn]")
    assert page.locator("path.edge").count() > 0
    assert page.evaluate("() => smachpy.store.view.selected.value") == "/JOB/B"


def test_while_the_page_opens_the_layout_follows_the_shape_that_is_left(served, look):
    served.add("one", labels="ABCD", events=[("Started", "/JOB"), ("Entered", "/JOB/A")])
    page = look(served.start())
    page.evaluate(
        "() => { smachpy.page.layouts.openedAt = 1e9; }"
    )  # it opens as long as the test takes
    page.set_viewport_size({"width": 1000, "height": 900})
    wait_for_shape = """() => { const { view, layouts: { layout, running } } = smachpy.page;
      return !running && layout.suits(view.aspect); }"""
    page.wait_for_function(wait_for_shape)
    page.set_viewport_size({"width": 1400, "height": 560})
    page.wait_for_function(wait_for_shape)
    page.evaluate("() => { smachpy.page.layouts.openedAt = -1e6; }")  # long ago: it stays as it is
    aspect = page.evaluate("() => smachpy.page.layouts.layout.aspect")
    page.set_viewport_size({"width": 800, "height": 900})
    page.wait_for_function(
        "() => { const { view, layouts: { fitted } } = smachpy.page; return view.height > 500 && view.is(fitted); }"
    )
    assert page.evaluate("() => smachpy.page.layouts.layout.aspect") == aspect


def test_long_outcomes_are_cut_with_the_whole_in_a_tip(served, look):
    long = "x" * 5000
    sm = StateMachine(outcomes=[long], name="JOB")
    with sm:
        StateMachine.add("A", CBState(lambda _: "y", outcomes=["y" * 5000]), {"y" * 5000: long})
    served.add("one", sm=sm)
    page = look(served.start())
    assert page.evaluate("() => smachpy.page.diagram.size.w") < 600
    assert page.text_content(".pill title").startswith("x" * 300)


def test_there_is_no_minimap_of_no_machine(served, look):
    page = look(served.start(), drawn=False)
    page.wait_for_selector("text=No machine on the network yet")
    wait_for(page, "getComputedStyle(document.querySelector('.minimap')).opacity === '0'")


def left_and_width(page, selector):
    box = page.locator(selector).bounding_box()
    return box["x"], box["width"]


@pytest.mark.parametrize(("width", "height"), [(1440, 900), (900, 900), (844, 390), (390, 844)])
def test_nothing_stands_beside_the_words_that_a_machine_is_missing(served, look, width, height):
    served.add("one", events=[("Started", "/JOB"), ("Entered", "/JOB/A")])
    page = look(f"{served.start()}?machine=nobody", drawn=False)
    page.set_viewport_size({"width": width, "height": height})
    page.wait_for_selector("text=No machine is called")
    wait_for(page, "!document.querySelector('.dock').checkVisibility()")
    assert left_and_width(page, ".stage") == (0, width)
    for other in (".dock", ".parts", ".play", ".strip", ".time-tools"):
        assert not [one for one in page.locator(other).all() if one.is_visible()], other
    page.click(".empty button:has-text('one')")
    page.wait_for_selector("html[data-drawn]")
    page.wait_for_selector(".diagram", state="visible")
    assert page.is_visible(".parts") == (width == 390 or height == 390)
    assert page.is_visible(".dock.bottom") == page.is_hidden(".parts")


def test_titles_that_are_enlarged_stay_inside_their_containers(served, look):
    big = chain([f"STEP_{n}" for n in range(30)], name="CHAIN")
    with big:
        inner = chain(["A"])
        StateMachine.add("RECHARGE_THE_BATTERY", inner, {"done": "done"})
    served.add("one", sm=big)
    page = look(served.start())
    page.set_viewport_size({"width": 390, "height": 844})
    all_levels(page)
    wait_for(page, "smachpy.page.view.k < 0.6")
    sizes = page.evaluate(
        """() => [...document.querySelectorAll("svg .box")].map((box) => {
          const title = box.querySelector(".title").getBoundingClientRect();
          const frame = box.querySelector(".frame").getBoundingClientRect();
          return { name: box.querySelector(".title").textContent, over: title.right - frame.right,
            font: parseFloat(getComputedStyle(box.querySelector(".title")).fontSize) }; })"""
    )
    assert {one["name"] for one in sizes} == {"CHAIN", "RECHARGE_THE_BATTERY"}
    assert max(one["font"] for one in sizes) > 11  # enlarged
    assert all(one["over"] < 0 for one in sizes)


def test_an_outline_is_offered_where_names_are_small(served, look):
    served.add("deep", sm=nested(4, 2))
    page = look(served.start())
    outline = page.get_by_role("button", name="Outline")
    all_levels(page)
    wait_for(page, "smachpy.page.view.k < 0.9")
    outline.click()
    wait_for(page, "smachpy.store.view.opened.value.size === 1")
    wait_for(page, "!smachpy.store.view.textIsSmall.value")
    outline.wait_for(state="detached")


@pytest.mark.parametrize("size", [(1440, 900), (1024, 768), (390, 844), (844, 390)])
def test_the_outline_of_one_level_is_tiles_with_larger_names_and_back(served, look, size):
    served.add("long", labels=[f"STATE_{i}" for i in range(24)])
    page = look(served.start(), viewport=dict(zip(("width", "height"), size, strict=True)))
    arrows = all_levels(page)
    outline = page.get_by_role("button", name="Outline")
    outline.wait_for()
    outline.click()
    wait_for(page, "smachpy.store.view.overview.value && !smachpy.page.layouts.running")
    assert page.locator("path.edge").count() == 0
    assert page.evaluate("() => smachpy.page.view.k") > 1.25 * arrows["k"]
    outline.click()
    wait_for(page, "!smachpy.store.view.overview.value && !smachpy.page.layouts.running")
    assert page.locator("path.edge").count() > 20


@pytest.mark.parametrize(
    ("tiles", "scale", "offered"),
    [(False, 1.15, True), (False, 1.25, False), (True, 1.15, False), (True, 0.95, True)],
)
def test_less_is_offered_where_labels_of_arrows_are_small_or_names_of_tiles(
    served, look, tiles, scale, offered
):
    """Labels have 11 px at a scale of 1.22, names at 1."""
    served.add("long", labels="ABC")
    page = look(served.start())
    font, is_small = page.evaluate(
        """async ([tiles, scale]) => { const { page: { layouts, view }, store } = smachpy;
          await layouts.running;
          if (tiles) { layouts.toggleOutline(); await layouts.running; }
          view.set(0, 0, scale);
          const text = document.querySelector(tiles ? ".diagram .name" : ".diagram :is(.label, .outcome)");
          return [parseFloat(getComputedStyle(text).fontSize), store.view.textIsSmall.value]; }""",
        [tiles, scale],
    )
    assert font == (11 if tiles else 9)
    assert is_small is offered


@pytest.mark.parametrize(("width", "offered"), [(1024, True), (1440, False)])
def test_where_the_tree_is_hidden_it_is_offered_for_tiles_with_small_names(
    served, look, width, offered
):
    served.add("long", labels=[f"STATE_{i}" for i in range(200)])
    page = look(served.start())
    page.set_viewport_size({"width": width, "height": 700})
    all_levels(page)
    wait_for(page, "smachpy.store.view.textIsSmall.value")
    tree = page.locator(".zoom .of-tree")
    tree.wait_for(state="attached")
    assert tree.is_visible() is offered  # else the tree stands beside the machine
    if offered:
        tree.click()
        page.wait_for_selector(".with-tree .panel-tree", state="visible")


@pytest.mark.parametrize("size", [(1440, 900), (1024, 768), (390, 844)])
def test_the_first_look_has_no_more_levels_than_can_be_read(served, look, size):
    served.add("deep", sm=nested(5, 2))
    page = look(served.start(), viewport=dict(zip(("width", "height"), size, strict=True)))
    k, levels = page.evaluate(
        """async () => { const { page, store } = smachpy;
          await page.layouts.relayout({ frame: true });
          return [page.view.k, store.view.opened.value.size]; }"""
    )
    assert k >= 0.72 or levels == 1


TITLES = """() => [...document.querySelectorAll('.diagram g.box')].map((box) => {
    const [frame, title] = ['.frame', '.title'].map((part) => box.querySelector(part).getBoundingClientRect());
    return [title.top + 0.2 * title.height - frame.top, frame.right - title.right]; // from the capitals
})"""


@pytest.mark.parametrize("size", [(1440, 900), (390, 844), (844, 390)])
def test_titles_are_inside_of_their_containers(served, look, size):
    served.add("recovery", sm=recovery())
    page = look(served.start())
    page.set_viewport_size(dict(zip(("width", "height"), size, strict=True)))
    all_levels(page)
    titles = page.evaluate(TITLES)
    assert titles
    assert min(above for above, _ in titles) >= 1
    assert min(right for _, right in titles) >= 0


def test_in_a_low_window_the_machine_has_the_most_room(served, look):
    events = [("Started", "/RECOVERY"), ("Entered", "/RECOVERY/DRIVE")]
    served.add("recovery", sm=recovery(), events=events)
    page = look(served.start())
    page.set_viewport_size({"width": 900, "height": 600})
    below = "document.querySelector('.dock.bottom').clientHeight"
    wait_for(page, f"smachpy.page.view.height > {below} && {below} > 100")
