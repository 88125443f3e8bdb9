from __future__ import annotations

import pytest

from smachpy.places.exceptions import InputFileError
from smachpy.places.maps import OFFICE_MAP, OFFICE_ROBOT, OFFICE_TOUR, OFFICE_WAYPOINTS
from smachpy.places.robot_file import load_config
from smachpy.states import load_route
from smachpy_missions.tour.tour_file import Task, load_tour


def test_the_office_route_lies_on_the_office_floor():
    route = load_route(OFFICE_WAYPOINTS)
    assert [w.name for w in route.waypoints][:2] == ["office 1", "kitchen"]
    assert route.dock.pose == load_config(OFFICE_ROBOT).dock
    assert 0 < route.low_battery < route.charge_until <= 1


def test_without_a_floor_only_the_form_is_checked(tmp_path):
    path = tmp_path / "w.yaml"
    path.write_text("dock: {x: 0, y: 0}\nwaypoints: [{x: 500, y: 0}]\n")
    assert load_route(path).waypoints[0].name == "waypoint 1"
    path.write_text("dock: {x: 0, y: 0}\nwaypoints: []\n")
    with pytest.raises(InputFileError, match="at least one entry"):
        load_route(path)


def problems(path, **options):
    with pytest.raises(InputFileError) as error:
        load_tour(path, **options)
    return [str(problem).removeprefix(f"{path}:") for problem in error.value.problems]


def test_csv_and_yaml_say_the_same(tmp_path):
    table, yaml = tmp_path / "w.csv", tmp_path / "w.yaml"
    table.write_text(
        "# my list\n\nname, x, y, yaw, dwell, task, angle, service\n"
        '"7", 1, 2, 0.5, 3, turn, 45\n'
        "gate,4,5,,,wait_for_service,,cargo/loaded\n"
    )
    yaml.write_text(
        "waypoints:\n"
        "  - {name: '7', x: 1, y: 2, yaw: 0.5, dwell: 3, task: turn, angle: 45}\n"
        "  - {name: gate, x: 4, y: 5, task: wait_for_service, service: cargo/loaded}\n"
    )
    tour = load_tour(table)
    assert tour == load_tour(yaml)
    assert tour.waypoints[0].task == Task("turn", angle=45.0)
    assert tour.waypoints[1].task.service == "cargo/loaded"


def test_a_line_is_a_comment_only_outside_quotes(tmp_path):
    path = tmp_path / "w.csv"
    path.write_text('# list\nname,x,y\n"#dock",1,2\n # not this\n"two\n# lines",3,4\nz,q,5\n')
    assert "7: waypoints[2].x: got 'q'" in problems(path)[0]
    path.write_text(path.read_text().replace("q", "5"))
    assert [w.name for w in load_tour(path).waypoints] == ["#dock", "two\n# lines", "z"]


def test_a_csv_row_is_named_with_its_line_and_column(tmp_path):
    path = tmp_path / "w.csv"
    path.write_text(
        "name,x,y,yaw,dwell,task,service\n"
        "wall,0.5,5.0\n"
        "\n"
        "off,99,5\n"
        "nan,17.3,nan,,,turrn\n"
        "gate,9,7.5,,-1,wait_for_service,a b\n"
        "desk,9,7.5,,,photo,gate\n"
        "tight,0.75,5.0\n"
    )
    found = problems(path, map_file=OFFICE_MAP)
    assert found == [
        "2: waypoints[0].x: got 0.5; expected a place where the robot can stand. wall: (0.50, 5.00) is in a wall or another solid thing.",
        "4: waypoints[1].x: got 99; expected a place where the robot can stand. off: (99.00, 5.00) is outside the map of 27 x 17 m.",
        "5: waypoints[2].task: got 'turrn'; expected one of ['photo', 'turn', 'wait_for_service']. Did you mean 'turn'?",
        "5: waypoints[2].y: got nan; expected a number [m].",
        "6: waypoints[3].dwell: got -1; expected a number [s] at least 0.",
        "6: waypoints[3].service: got 'a b'; expected a name of the network. ' ' is not allowed; expected letters, digits, '_' or '/'.",
        "7: waypoints[4].service: got 'gate'; expected the service of the task 'wait_for_service', and only of that.",
        "8: waypoints[5].x: got 0.75; expected a place where the robot can stand. tight: (0.75, 5.00) is too near to a wall: the robot needs 0.28 m around it.",
    ]


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "1: got an empty file; expected a header line"),
        ("kitchen,4.6,10.6\n", "1: got 'kitchen,4.6,10.6'; expected a header line"),
        ("x,y\n1,2,3\n", "2: got 3 cells; expected at most 2, as in line 1"),
        ("x,y,x\n1,2,3\n", "1: x: got two columns of this name"),
        ('name,x,y\n"a,1,2\n', "not CSV: unexpected end of data."),
        (f"name,x,y\n{'a' * 140_000},1,2\n", "not CSV: field larger than field limit"),
        ("name,x,y\na,\u0663,2\n", "x: got '\u0663'; expected a number"),
        ("nme,x,y\na,1,2\n", "Did you mean 'name'?"),
        ("name,x,y\n", "waypoints: got []; expected a list with at least one entry"),
    ],
)
def test_a_csv_file_of_another_form_is_refused(tmp_path, text, problem):
    path = tmp_path / "w.csv"
    path.write_text(text)
    assert problem in problems(path)[0]


def test_a_csv_file_that_cannot_be_read_is_refused(tmp_path):
    with pytest.raises(InputFileError, match=r"nowhere\.csv: got 'No such file"):
        load_tour(tmp_path / "nowhere.csv")
    (tmp_path / "bytes.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputFileError, match="no UTF-8"):
        load_tour(tmp_path / "bytes.csv")


def test_the_office_tour_and_places_lie_on_the_office_floor():
    assert [w.task and w.task.kind for w in load_tour(OFFICE_TOUR).waypoints].count("photo") == 2
