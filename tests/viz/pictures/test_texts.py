"""The picture as Mermaid and as an outline."""

from __future__ import annotations

import re

from smachpy import viz


def test_the_outline_has_a_line_per_state_and_rule(patrol):
    text = viz.picture(patrol, "txt", active=["CHARGE/DOCK"]).decode()
    assert text.splitlines() == [
        "\u25b8 PATROL",
        "\u251c\u2500 * WATCHED_DRIVE (concurrent)  succeeded \u2192 succeeded, battery_low \u2192 CHARGE",
        "\u2502  \u251c\u2500 * DRIVE",
        "\u2502  \u2502  \u251c\u2500 * NEXT_WAYPOINT  drive \u2192 GO_THERE, round_done \u2192 succeeded",
        "\u2502  \u2502  \u251c\u2500 \u25ba GO_THERE  succeeded \u2192 NEXT_WAYPOINT, aborted \u2192 RECOVER",
        "\u2502  \u2502  \u2514\u2500 RECOVER  succeeded \u2192 GO_THERE",
        "\u2502  \u2502     \u251c\u2500 * \u2194 CLEAR_MAP  succeeded \u2192 TURN",
        "\u2502  \u2502     \u251c\u2500 \u25ba TURN  succeeded \u2192 succeeded, aborted \u2192 BACK_UP",
        "\u2502  \u2502     \u2514\u2500 \u25ba BACK_UP  succeeded \u2192 succeeded",
        "\u2502  \u251c\u2500 * \u25cf BATTERY",
        "\u2502  \u251c\u2500 battery_low \u2190 BATTERY:invalid",
        "\u2502  \u251c\u2500 succeeded \u2190 DRIVE:succeeded",
        "\u2502  \u2514\u2500 aborted \u2190 DRIVE:aborted",
        "\u2514\u2500 \u25b8 CHARGE  succeeded \u2192 WATCHED_DRIVE",
        "   \u251c\u2500 \u25b8 * \u25ba DOCK  succeeded \u2192 WAIT_FULL",
        "   \u2514\u2500 \u25cf WAIT_FULL  valid/invalid \u2192 succeeded",
    ]


def test_mermaid_nests_states_and_marks_the_active_one(patrol):
    text = viz.picture(patrol, "mmd", path="CHARGE", active=["CHARGE/DOCK"]).decode()
    assert text.splitlines() == [
        "stateDiagram-v2",
        '  state "CHARGE" as s0 {',
        '    state "DOCK" as s1',
        '    state "WAIT_FULL" as s2',
        '    state "succeeded" as s0_o0',
        '    state "aborted" as s0_o1',
        '    state "preempted" as s0_o2',
        "    [*] --> s1",
        "    s1 --> s2 : succeeded",
        "    s2 --> s0_o0 : valid / invalid",
        "  }",
        "  classDef active fill:#CFE8FA,stroke:#0082D4,color:#003E66",
        "  class s1 active",
    ]


def test_mermaid_text_has_no_marks_of_its_own_in_names(build):
    record = build.rooted(build.leaf('a"; b: [x] {y} <z> %%c --> d'))
    (line,) = viz.picture(record, "mmd").decode().splitlines()[1:]
    name = re.fullmatch(r'  state "(.*)" as s0', line)[1]
    assert not set(re.sub(r"#\d+;", "", name)) & set('"[]{}<>;:%#')


def test_mermaid_gets_no_empty_name(build):
    record = build.rooted(build.leaf(" "))
    assert 'state "\u00a0" as s0' in viz.picture(record, "mmd").decode()
