from __future__ import annotations

import pytest

from smachpy_viz.model.extract import UnknownPathError, extract, find, readable_depth


def child(node, label):
    (found,) = (c for c in node.children if c.label == label)
    return found


def test_every_state_appears_with_its_path(patrol):
    drawn = [node.path for node in extract(patrol, depth=9).walk()]
    assert drawn == [state.path for state in patrol.walk()]


def test_depth_closes_what_lies_deeper_and_counts_it(patrol):
    root = extract(patrol, depth=1)
    assert [c.label for c in root.children] == ["WATCHED_DRIVE", "CHARGE"]
    assert not any(c.is_open for c in root.children)
    assert child(root, "WATCHED_DRIVE").hidden == 8
    assert child(root, "CHARGE").hidden == 2


def test_outcomes_to_one_target_share_an_edge(patrol):
    charge = child(extract(patrol), "CHARGE")
    (edge,) = (e for e in charge.edges if e.source == "WAIT_FULL" and not e.implicit)
    assert edge.outcomes == ("valid", "invalid")
    assert edge.target == "succeeded"
    assert edge.to_outcome


def test_edges_that_close_a_loop_lead_back(patrol):
    root = extract(patrol)
    drive = child(child(root, "WATCHED_DRIVE"), "DRIVE")
    back = {(e.source, e.target) for e in drive.edges if e.back}
    assert back == {("GO_THERE", "NEXT_WAYPOINT"), ("RECOVER", "GO_THERE")}


def test_a_state_that_follows_itself_leads_back(build):
    record = build.rooted(build.machine("M", [build.leaf("A")], {"A": {"aborted": "A"}}))
    (edge,) = (e for e in extract(record).edges if e.target == "A")
    assert edge.back


def test_failures_that_nobody_wrote_down_are_hidden_until_asked_for(patrol):
    def implicit(node):
        return {(e.source, o) for e in node.edges if e.implicit for o in e.outcomes}

    drive = child(child(extract(patrol), "WATCHED_DRIVE"), "DRIVE")
    everything = child(child(extract(patrol, show_implicit=True), "WATCHED_DRIVE"), "DRIVE")
    assert implicit(drive) == set()
    assert implicit(everything) == {
        ("GO_THERE", "preempted"),
        ("RECOVER", "aborted"),
        ("RECOVER", "preempted"),
    }


def test_a_default_way_to_an_ordinary_end_is_drawn(patrol):
    recover = child(child(child(extract(patrol), "WATCHED_DRIVE"), "DRIVE"), "RECOVER")
    assert ("BACK_UP", "succeeded") in {(e.source, e.target) for e in recover.edges if e.implicit}


def test_outcomes_reached_only_by_default_are_told_apart(patrol):
    drive = child(child(extract(patrol), "WATCHED_DRIVE"), "DRIVE")
    assert {(p.outcome, p.by_default) for p in drive.pills} == {
        ("succeeded", False),
        ("aborted", True),
    }


def test_the_outermost_machine_shows_all_its_outcomes(patrol):
    assert [p.outcome for p in extract(patrol).pills] == ["succeeded", "aborted", "preempted"]


@pytest.mark.parametrize("states", [60, 500])
def test_the_default_depth_keeps_a_picture_readable(large, states):
    record = large(states)
    visible = sum(1 for _ in extract(record).walk())
    assert visible <= 60 or readable_depth(record) == 1


def test_a_small_machine_is_drawn_whole(patrol):
    assert readable_depth(patrol) >= 4
    assert not any(node.hidden for node in extract(patrol).walk())


def test_a_wide_machine_opens_one_level_all_the_same(build):
    record = build.rooted(build.machine("M", [build.leaf(f"S{i}") for i in range(200)], {}))
    assert readable_depth(record) == 1
    assert len(extract(record).children) == 200


@pytest.mark.parametrize("path", ["/PATROL/CHARGE", "CHARGE", "/CHARGE/", "PATROL/CHARGE"])
def test_find_takes_paths_with_and_without_the_root(patrol, path):
    assert find(patrol, path).path == "/PATROL/CHARGE"


def test_find_names_the_nearest_paths(patrol):
    with pytest.raises(UnknownPathError, match="/PATROL/CHARGE/DOCK") as caught:
        find(patrol, "/PATROL/CHARGE/DOK")
    assert caught.value.path == "/PATROL/CHARGE/DOK"


def test_a_plain_state_can_be_drawn_alone(build):
    record = build.rooted(build.leaf("ALONE"))
    node = extract(record)
    assert not node.is_open
    assert node.hidden == 0


def test_every_arrow_of_an_open_container_starts_at_an_outcome(patrol, large):
    for record in (patrol, large(60)):
        for node in extract(record, depth=9, show_implicit=True).walk():
            pills = {c.label: {p.outcome for p in c.pills} for c in node.children if c.is_open}
            for edge in node.edges:
                assert set(edge.outcomes) <= pills.get(edge.source, set(edge.outcomes))
