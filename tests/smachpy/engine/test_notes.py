"""What a state says about itself: `self.note("aisle 7")`."""

from __future__ import annotations

from smachpy import State, StateMachine
from smachpy.events import Noted
from smachpy.machines.state import LONGEST_NOTE


class Pick(State):
    def __init__(self, notes):
        super().__init__(outcomes=["done"])
        self.notes = notes

    def execute(self, userdata):
        for note in self.notes:
            self.note(note)
        return "done"


def events_of(*notes):
    sm = StateMachine(outcomes=["done"], name="JOB")
    with sm:
        StateMachine.add("PICK", Pick(notes), {"done": "done"})
    heard = []
    sm.subscribe(heard.append)
    sm.execute()
    return heard


def test_notes_are_events_of_the_state_in_their_order():
    notes = [event for event in events_of("aisle 6", "aisle 7") if isinstance(event, Noted)]
    assert [(one.path, one.text) for one in notes] == [
        ("/JOB/PICK", "aisle 6"),
        ("/JOB/PICK", "aisle 7"),
    ]


def test_a_long_note_is_cut():
    (note,) = [event for event in events_of("x" * 999) if isinstance(event, Noted)]
    assert note.text == "x" * LONGEST_NOTE


def test_a_note_outside_of_a_run_goes_nowhere():
    Pick([]).note("nobody hears it")


def test_a_state_of_its_users_may_have_a_note_of_its_own():
    class Mine(Pick):
        note = "mine"

    assert Mine([]).note == "mine"
