"""Questions of missions on the page: answered by one, seen by all."""

from __future__ import annotations

import json
import urllib.error
import urllib.request

import pytest

from tests.browser import start_clock, stop_clock, wait_for

ASKED = {
    "text": "Delivery to lab: may I hand it over?",
    "answers": ["yes", "no"],
    "words": ["Yes, hand over", ""],
    "default": "no",
    "patience": 60.0,
    "service": "operator/questions/q1",
    "has_picture": False,
}
WAITS = [("Started", "/JOB"), ("Entered", "/JOB/A"), ("QuestionAsked", "/JOB/A", ASKED)]
OPEN = ".question:not(.over)"
ANSWERED = "document.querySelector('.question.over .hint')?.textContent"


def post(view, command, token):
    body = json.dumps(command).encode()
    headers = {"origin": view.base.rstrip("/"), "x-smachpy-token": token}
    request = urllib.request.Request(view.base + "api/control?machine=errand", body, headers)
    try:
        with urllib.request.urlopen(request, timeout=60) as answer:
            return answer.status, json.loads(answer.read())
    except urllib.error.HTTPError as error:
        return error.code, json.loads(error.read())


@pytest.fixture
def no_leaks():
    """Processes of this module's fixtures outlive single tests."""


@pytest.mark.browser
@pytest.mark.zenoh
def test_a_question_is_answered_on_one_page_and_closes_on_all(errand, look):
    """The mission itself takes no commands; its questions do."""
    one, two = (look(f"{errand.base}?machine=errand#token={errand.token}") for _ in range(2))
    one.evaluate("() => { smachpy.store.view.operator.value = 'ann'; }")
    for page in (one, two):
        page.wait_for_selector(OPEN)
        assert "may I hand it over?" in page.text_content(f"{OPEN} h3")
        wait_for(page, "document.title.startsWith('(1) ERRAND')")
        assert page.text_content("[data-testid=status]") == "asks you"
        buttons = page.locator(f"{OPEN} .answer")
        assert buttons.all_text_contents() == ["No, come back", "Yes, hand over"]
        wait_for(page, "document.querySelector('.question-picture').naturalWidth === 1")
    wait_for(one, "document.activeElement.tagName === 'H3'")
    for page in (one, two):
        stop_clock(page)
    one.click(f"{OPEN} .answer.primary")
    for page in (one, two):
        wait_for(page, f"{ANSWERED}?.includes('answered yes by ann')")
        start_clock(page)
    wait_for(two, "!document.querySelector('.question.over')")
    wait_for(two, f"document.querySelector('{OPEN}')")  # it asks again


@pytest.mark.browser
@pytest.mark.zenoh
def test_of_two_answers_at_once_one_counts(errand, look):
    page = look(f"{errand.base}?machine=errand#token={errand.token}")
    page.wait_for_selector(OPEN)
    stop_clock(page)
    answers = page.evaluate(
        """async () => {
          const [[path]] = Object.entries(smachpy.store.data.run.now.states).filter(([,
            s]) => s.question?.answered === null);
          const give = (answer) => fetch("/api/control?machine=errand", {
            method: "POST", headers: { "x-smachpy-token": sessionStorage.getItem("smachpy.token") },
            body: JSON.stringify({ command: "answer", path, answer, by: answer }) }).then((r) => r.json());
          return Promise.all(["yes", "no", "yes", "no"].map(give));
        }"""
    )
    assert [one["ok"] for one in answers].count(True) == 1
    (winner,) = (i for i, one in enumerate(answers) if one["ok"])
    wait_for(page, f"{ANSWERED}?.includes('answered {('yes', 'no')[winner % 2]} by')")


@pytest.mark.zenoh
def test_nobody_answers_without_the_token(errand):
    answer = {"command": "answer", "path": "/ERRAND/CONFIRM", "answer": "yes"}
    assert post(errand, answer, "wrong")[0] == 403
    status, told = post(
        errand, {"command": "answer", "path": "/ERRAND/GO", "answer": "yes"}, errand.token
    )
    assert (status, "nobody asks" in told["text"]) == (409, True)
    status, told = post(errand, {"command": "answer", "path": 7}, errand.token)
    assert status == 409


@pytest.mark.browser
def test_the_buttons_do_nothing_without_a_token_or_in_the_past(served, look):
    served.add("one", events=WAITS)
    page = look(served.start(token="t"))
    page.wait_for_selector(OPEN)
    assert page.locator(f"{OPEN} .answer:disabled").count() == 2
    assert "smachpy answer" in page.text_content(OPEN)
    page = look(f"{served.address}#token=t")
    page.wait_for_selector(OPEN)
    page.evaluate("() => smachpy.store.playback.seek(smachpy.store.data.run.first())")
    page.click(f"{OPEN} .answer:text('Back to live to answer')")
    wait_for(page, "smachpy.store.playback.cursor.value === null")
    with page.expect_response("**/api/control*"):
        page.click(f"{OPEN} .answer.primary")
    (sent,) = served.commands
    assert (sent["command"], sent["path"], sent["answer"]) == ("answer", "/JOB/A", "yes")
    assert sent["by"].startswith("page at ")


@pytest.mark.browser
def test_each_question_sounds_once(served, look):
    """Not again when a newer one is answered and it is the newest that waits."""
    machine = served.add("one", events=WAITS[:2])
    page = look(f"{served.start(token='t')}#token=t")
    page.evaluate(
        """() => {
            window.sounds = 0;
            window.AudioContext = class extends AudioContext {
                constructor() { super(); window.sounds += 1; }
            };
        }"""
    )
    later = {**ASKED, "service": "operator/questions/q2"}
    answered = {"service": later["service"], "answer": "yes", "by": "ann"}
    steps = [
        (WAITS[2], 1, 1),
        (("Entered", "/JOB/B"), 1, 1),
        (("QuestionAsked", "/JOB/B", later), 2, 2),
        (("QuestionAnswered", "/JOB/B", answered), 1, 2),
    ]
    for seq, (event, waiting, sounds) in enumerate(steps, 2):
        machine.add(served.events([event], after=seq))
        wait_for(page, f"document.querySelectorAll('{OPEN}').length === {waiting}")
        wait_for(page, f"window.sounds >= {sounds}")
    wait_for(page, "!document.querySelector('.question.over')")  # drawn again and again till then
    assert page.evaluate("() => window.sounds") == 2


@pytest.mark.browser
def test_a_breakpoint_lets_the_operator_decide(served, look):
    events = [*WAITS[:2], ("Paused", "/JOB/B", {"reason": "breakpoint"})]
    served.add("one", events=events, control={"paused": True, "breakpoints": [["/JOB/B", None]]})
    page = look(f"{served.start(token='t')}#token=t")
    page.click(".question.held .answer:text('Resume')")
    page.wait_for_selector(".notice.info")
    assert [one["command"] for one in served.commands] == ["resume"]


@pytest.mark.browser
@pytest.mark.parametrize("text", ["<img src=x onerror=alert(1)>", "x" * 5000, "\u202e\u65e5\u672c"])
def test_words_of_questions_are_only_text(served, look, text):
    asked = {**ASKED, "text": text, "words": [text, text], "answers": ["yes", text]}
    served.add("one", events=[*WAITS[:2], ("QuestionAsked", "/JOB/A", asked)])
    page = look(f"{served.start(token='t')}#token=t")
    page.wait_for_selector(OPEN)
    assert page.locator(f"{OPEN} img").count() == 0
    assert page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")


# Parts of an element, and of what is drawn above it at the middle of its edges.
APART = """() => { const [card, page] = [".questions", ".home, .fleet, .actions-page"]
        .map((one) => document.querySelector(one).getBoundingClientRect());
    const answers = [...document.querySelectorAll(".answer")].map((one) => one.getBoundingClientRect());
    return { over: Math.min(card.right, page.right) > Math.max(card.left, page.left)
        && Math.min(card.bottom, page.bottom) > Math.max(card.top, page.top),
      room: [page.width, page.height], cut: answers.some((one) => one.bottom > innerHeight || one.right > innerWidth),
      wide: document.documentElement.scrollWidth > innerWidth }; }"""


@pytest.mark.browser
@pytest.mark.parametrize("size", [(390, 844), (844, 390)])
@pytest.mark.parametrize("shown", ["runs", "fleet", "actions"])
def test_a_question_covers_no_page_of_a_phone(served, look, size, shown):
    served.add("one", events=WAITS)
    viewport = {"width": size[0], "height": size[1]}
    page = look(f"{served.start(token='t')}?{shown}#token=t", drawn=False, viewport=viewport)
    # The question of another machine at first, which goes before that of the machine shown comes.
    page.wait_for_selector(f"{OPEN} .answer")
    page.wait_for_selector(".home, .fleet, .actions-page")
    seen = page.evaluate(APART)
    assert (seen["over"], seen["cut"], seen["wide"]) == (False, False, False)
    assert seen["room"][0] >= 390
    assert seen["room"][1] >= 240


@pytest.mark.browser
def test_a_phone_shows_the_question_and_its_buttons_at_once(served, look):
    served.add("one", events=WAITS)
    page = look(f"{served.start(token='t')}#token=t")
    page.set_viewport_size({"width": 390, "height": 844})
    page.wait_for_selector(OPEN)
    wait_for(
        page, "document.querySelector('.answer').getBoundingClientRect().bottom <= innerHeight"
    )
    sizes = page.evaluate(
        "() => [...document.querySelectorAll('.answer')].map((b) => b.getBoundingClientRect().height)"
    )
    assert min(sizes) >= 48
    assert page.locator("[role=alertdialog]").evaluate(
        "(card) => document.getElementById(card.getAttribute('aria-labelledby')).textContent"
    )
    assert " " not in page.get_attribute("[role=alertdialog]", "aria-labelledby")


@pytest.mark.browser
def test_beside_a_question_no_button_of_a_phone_held_sideways_is_cut(served, look):
    served.add("one", labels="ABCDEFGHIJKL", events=WAITS)
    page = look(f"{served.start(token='t')}#token=t", viewport={"width": 844, "height": 390})
    page.wait_for_selector(OPEN)
    cut = """() => { const { right } = document.querySelector('.stage').getBoundingClientRect();
        return [...document.querySelectorAll('.strip button')].map((b) => b.getBoundingClientRect())
            .filter((box) => box.width && box.right > right).length; }"""
    page.wait_for_selector(".zoom .offer")  # the widest
    assert page.evaluate(cut) == 0


@pytest.mark.browser
def test_a_phone_held_sideways_shows_the_answers_below_the_picture(served, look):
    asked = {**ASKED, "has_picture": True}
    served.add(
        "one",
        events=[*WAITS[:2], ("QuestionAsked", "/JOB/A", asked)],
        control={"paused": False, "breakpoints": []},
    )
    page = look(f"{served.start(token='t')}#token=t", drawn=False)
    picture = b'<svg xmlns="http://www.w3.org/2000/svg" width="160" height="90"/>'
    page.route(
        "**/api/question*",
        lambda route: route.fulfill(body=picture, content_type="image/svg+xml"),
    )
    page.set_viewport_size({"width": 844, "height": 390})
    page.reload()
    page.wait_for_selector(".question-picture")
    page.wait_for_selector("#preempt")
    below = """() => document.querySelector('.operator').getBoundingClientRect().top
        - Math.max(...[...document.querySelectorAll('.answer')].map((b) => b.getBoundingClientRect().bottom))"""
    assert page.evaluate(below) >= 0
