"""The picture of the life cycles in the docs is that of the tables."""

from __future__ import annotations

from actionlib_core.goal.diagram import draw_life_cycles
from tests.places import DOCS

IMAGES = DOCS / "images"


def test_picture_in_the_docs_is_up_to_date():
    """If not: python -c 'from actionlib_core.goal.diagram import *; print(draw_life_cycles())'."""
    assert (IMAGES / "goal_life_cycles.dot").read_text() == draw_life_cycles()
    assert "WAITING_FOR_CANCEL_ACK" in (IMAGES / "goal_life_cycles.svg").read_text()


def test_every_state_and_the_known_edges_are_drawn():
    text = draw_life_cycles()
    assert 'server_PENDING -> server_ACTIVE [label="accept"]' in text
    assert 'server_ACTIVE -> server_PREEMPTING [label="request_cancel"]' in text
    assert 'client_WAITING_FOR_RESULT -> client_DONE [label="result"]' in text
