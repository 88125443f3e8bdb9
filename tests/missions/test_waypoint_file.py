from __future__ import annotations

import pytest

from missions.exceptions import InputFileError
from missions.maps import OFFICE_MAP, OFFICE_ROBOT, OFFICE_WAYPOINTS
from missions.move_base.config import load_config
from missions.waypoint_file import load_route


def test_the_office_route_lies_on_the_office_floor():
    route = load_route(OFFICE_WAYPOINTS)
    assert [w.name for w in route.waypoints][:2] == ["office 1", "kitchen"]
    assert route.dock.pose == load_config(OFFICE_ROBOT).dock
    assert 0 < route.low_battery < route.charge_until <= 1


def test_every_bad_waypoint_is_named_with_line_and_field(tmp_path):
    path = tmp_path / "w.yaml"
    path.write_text(
        f"map: {OFFICE_MAP}\nrobot: {OFFICE_ROBOT}\ndock: {{x: 9.8, y: 7.1}}\n"
        "waypoints:\n"
        "  - {name: wall, x: 0.5, y: 5.0}\n"
        "  - {name: off, x: 50, y: 5.0}\n"
        "  - {name: tight, x: 0.75, y: 5.0}\n"
        "  - {x: here, y: 2}\n"
        "  - {name: fine, x: 2.0, y: 3.0, yaww: 1}\n"
        "charge_until: 0.1\n"
    )
    with pytest.raises(InputFileError) as error:
        load_route(path)
    problems = sorted(error.value.problems, key=lambda p: p.line)
    texts = [str(p).removeprefix(f"{path}:") for p in problems]
    assert [t.split(": got")[0] for t in texts] == [
        "5: waypoints[0].x",
        "6: waypoints[1].x",
        "7: waypoints[2].x",
        "8: waypoints[3].x",
        "9: waypoints[4].yaww",
        "10: charge_until",
    ]
    assert "wall: (0.50, 5.00) is in a wall" in texts[0]
    assert "outside the map" in texts[1]
    assert "too near to a wall" in texts[2]
    assert "got 'here'; expected a number [m]" in texts[3]


def test_without_a_floor_only_the_form_is_checked(tmp_path):
    path = tmp_path / "w.yaml"
    path.write_text("dock: {x: 0, y: 0}\nwaypoints: [{x: 500, y: 0}]\n")
    assert load_route(path).waypoints[0].name == "waypoint 1"
    path.write_text("dock: {x: 0, y: 0}\nwaypoints: []\n")
    with pytest.raises(InputFileError, match="at least one entry"):
        load_route(path)
