"""The state that records topics to a bag."""

from __future__ import annotations

import errno

import pytest

from actionlib_core.interfaces import ros2
from actionlib_core.interfaces.bags import BagError, BagWriter, read_bag
from actionlib_core.interfaces.sensor_msgs.msg import BatteryState
from actionlib_core.interfaces.std_msgs.msg import String
from smachpy import Concurrence, InvalidStateError, StateMachine
from smachpy.states import RecordBag, Wait

TOPICS = {"word": String, "battery": BatteryState}
POSE = ros2.get_message("geometry_msgs/PoseStamped")


def alone(state):
    sm = StateMachine(state.get_registered_outcomes(), name="ALONE")
    sm.add("STATE", state)
    return sm


def beside(state, work):
    """Record while the work runs."""
    both = Concurrence(
        ["done", "aborted", "preempted"],
        "aborted",
        outcome_map={"done": {"WORK": "done"}},
        child_termination_cb=lambda outcomes: outcomes["WORK"] is not None,
    )
    both.add("RECORD", state)
    both.add("WORK", work)
    return both


@pytest.mark.parametrize(
    ("make", "problem"),
    [
        (lambda: RecordBag("a.bag", TOPICS), "path: got 'a.bag'; expected a file .* .mcap"),
        (lambda: RecordBag("a.mcap", {}), "at least one topic"),
        (lambda: RecordBag("a.mcap", {"a b": String}), "topics: got 'a b'"),
        (lambda: RecordBag("a.mcap", {"a": 3}), "topics: a: got 3"),
        (lambda: RecordBag("a.mcap", TOPICS, seconds=-1), "seconds: got -1"),
        (lambda: RecordBag("a.mcap", TOPICS, key=""), "key: got ''"),
    ],
)
def test_wrong_arguments_are_refused_where_they_are_given(make, problem):
    with pytest.raises(InvalidStateError, match=problem):
        make()


def test_it_records_beside_the_work(mission, tmp_path):
    path = tmp_path / "new" / "drive.mcap"
    mission.topic("word", String).publish_every(2.0, [String("a"), String("b")], start=1.0)
    mission.topic("battery", BatteryState).publish_at(2.0, BatteryState(percentage=0.5))
    machine = beside(RecordBag(path, TOPICS, key="bag"), Wait(5.0))
    mission(machine).assert_outcome("done")
    found = [(one.at, one.topic) for one in read_bag(path)]
    assert found == [(0.0, "word"), (1.0, "battery"), (2.0, "word")]
    assert next(read_bag(path, ["battery"])).message == BatteryState(percentage=0.5)
    assert machine.userdata.bag == str(path)


def test_messages_of_ros_2_are_kept_as_such(mission, tmp_path):
    path = tmp_path / "drive.mcap"
    topic = mission.topic("pose", POSE)
    topic.publish_at(1.0, {"header": {"frame_id": "map"}})
    mission(alone(RecordBag(path, {"pose": POSE}, seconds=2.0))).assert_outcome("done")
    (one,) = read_bag(path)
    assert (one.type, one.message.header.frame_id) == ("geometry_msgs/PoseStamped", "map")


@pytest.mark.parametrize(("seconds", "count"), [(0, 0), (1.0, 1)])
def test_it_ends_after_its_time(mission, tmp_path, seconds, count):
    path = tmp_path / "drive.mcap"
    mission.topic("word", String).publish_every(1.0, String("a"), start=0.5)
    run = mission(alone(RecordBag(path, TOPICS, seconds=seconds)))
    run.assert_outcome("done")
    assert run.duration == seconds
    assert len(list(read_bag(path))) == count


@pytest.mark.parametrize("after", [0.0, 2.0])
def test_a_preempt_completes_the_file(mission, tmp_path, after):
    path = tmp_path / "drive.mcap"
    mission.topic("word", String).publish_every(0.5, String("a"), start=0.1)
    mission.preempt(on="STATE", after=after)
    run = mission(alone(RecordBag(path, TOPICS)))
    run.assert_outcome("preempted")
    assert run.duration == after
    assert len(list(read_bag(path))) == after / 0.5


def test_a_file_that_another_one_makes_at_the_same_time_is_left(mission, tmp_path, monkeypatch):
    """Of two branches with one path, one ended with 'aborted'."""
    path = tmp_path / "drive.mcap"

    def make(one):
        if one == path:
            path.write_bytes(b"of another")
        return BagWriter(one)

    monkeypatch.setattr("smachpy.states.bags.BagWriter", make)
    mission(alone(RecordBag(path, TOPICS, seconds=1.0))).assert_outcome("done")
    assert path.read_bytes() == b"of another"
    assert (tmp_path / "drive-2.mcap").exists()


def test_a_file_that_exists_is_never_changed(mission, tmp_path):
    path = tmp_path / "drive.mcap"
    path.write_bytes(b"precious")
    state = RecordBag(path, TOPICS, seconds=1.0)
    for _ in range(2):
        mission(alone(state)).assert_outcome("done")
    assert path.read_bytes() == b"precious"
    names = sorted(each.name for each in tmp_path.iterdir())
    assert names == ["drive-2.mcap", "drive-3.mcap", "drive.mcap"]


def test_a_folder_that_cannot_be_made_is_told(mission, tmp_path, caplog):
    (tmp_path / "file").touch()
    state = RecordBag(tmp_path / "file" / "drive.mcap", TOPICS)
    mission(alone(state)).assert_outcome("aborted")
    assert "cannot be made" in caplog.text


class FullDisk:
    """A file on a disk that is full after some bytes."""

    def __init__(self, file, room):
        self.file, self.room = file, room

    def write(self, data):
        self.room -= len(data)
        if self.room < 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        return self.file.write(data)

    def __getattr__(self, name):
        return getattr(self.file, name)


@pytest.mark.parametrize("room", [0, 100])
def test_a_full_disk_ends_it(mission, tmp_path, monkeypatch, caplog, room):
    opened = type(tmp_path).open
    monkeypatch.setattr(
        type(tmp_path), "open", lambda path, mode: FullDisk(opened(path, mode), room)
    )
    mission.topic("word", String).publish_at(1.0, String("a" * 2_000_000))
    run = mission(alone(RecordBag(tmp_path / "drive.mcap", TOPICS, seconds=9.0)))
    run.assert_outcome("aborted")
    assert "cannot be written: No space left on device" in caplog.text


def test_the_package_may_be_missing(monkeypatch, tmp_path):
    monkeypatch.setitem(__import__("sys").modules, "mcap.writer", None)
    with pytest.raises(BagError, match=r"pip install 'smachpy\[mcap\]'"):
        BagWriter(tmp_path / "drive.mcap")
    assert not list(tmp_path.iterdir())
