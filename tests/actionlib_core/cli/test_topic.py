"""`actionlib topic`, over the network in memory."""

from __future__ import annotations

import io
import json
import math
import sys
from functools import partial

import pytest
from ruamel.yaml import YAML

from actionlib_core.cli import main, topic
from actionlib_core.cli._message_text import MessageText, flatten, shorten, split_path, to_yaml
from actionlib_core.interfaces.geometry_msgs.msg import Point, PoseStamped
from actionlib_core.interfaces.sensor_msgs.msg import LaserScan
from actionlib_core.interfaces.std_msgs.msg import Float64MultiArray, Int32, String
from actionlib_core.pubsub.topic import Publisher, Subscriber

NODES = ("cli", "robot")


@pytest.fixture
def cli(nodes):
    return lambda *words: main(["topic", *words], node=nodes[0])


@pytest.fixture
def robot(nodes):
    return nodes[1]


def test_list(cli, robot, capsys):
    Publisher("chatter", String, node=robot)
    Subscriber("chatter", String, print, node=robot)
    Subscriber("count", Int32, print, node=robot)
    assert cli("list") == 0
    assert capsys.readouterr().out == "/chatter\n/count\n"
    cli("list", "-t")
    assert (
        capsys.readouterr().out == "/chatter [std_msgs/msg/String]\n/count [std_msgs/msg/Int32]\n"
    )
    cli("list", "-c")
    assert capsys.readouterr().out == "2\n"
    cli("list", "-v")
    assert capsys.readouterr().out.splitlines() == [
        "Published topics:", " * /chatter [std_msgs/msg/String] 1 publisher", "",
        "Subscribed topics:", " * /chatter [std_msgs/msg/String] 1 subscriber",
        " * /count [std_msgs/msg/Int32] 1 subscriber", "",
    ]  # fmt: skip
    cli("list", "--json")
    assert json.loads(capsys.readouterr().out)[0] == {
        "name": "/chatter", "types": ["std_msgs/msg/String"],
        "publishers": ["/robot"], "subscribers": ["/robot"],
    }  # fmt: skip


def test_the_limit_of_an_echo_includes_the_wait_for_the_topic(cli, clock, robot, capsys):
    """A bridge or a robot that starts offers its topics later than the 2 s of a mistyped name."""
    there = []
    publisher = partial(Publisher, "chatter", String, latch=True, node=robot)
    clock.call_later(30.0, lambda: there.append(publisher()))
    clock.call_later(31.0, lambda: there[0].publish(data="hello"))
    assert cli("echo", "chatter", "--once", "--timeout", "40") == 0
    assert "hello" in capsys.readouterr().out
    start = clock.now()
    assert cli("echo", "nobody", "--once", "--timeout", "40") == 2
    assert clock.now() - start == pytest.approx(40.0)
    assert "topic '/nobody': not there within 40 s; expected" in capsys.readouterr().err


def test_json_of_numbers_that_json_lacks(cli, robot, capsys):
    """They were written as NaN and Infinity, which parsers of JSON refuse."""
    scan = Publisher("scan", Float64MultiArray, latch=True, node=robot)
    scan.publish(Float64MultiArray(data=[math.inf, 1.5, math.nan]))
    assert cli("echo", "scan", "--once", "--json") == 0
    wanted = {"layout": {"dim": [], "data_offset": 0}, "data": [None, 1.5, None]}
    assert json.loads(capsys.readouterr().out, parse_constant=pytest.fail) == wanted
    assert cli("pub", "x", "std_msgs/Float64", "{data: .nan}", "-1", "-w", "0", "--json") == 0
    assert json.loads(capsys.readouterr().out, parse_constant=pytest.fail) == {"data": None}


def test_info_and_type(cli, robot, capsys):
    Publisher("chatter", String, node=robot)
    assert cli("info", "chatter") == 0
    assert capsys.readouterr().out == (
        "Type: std_msgs/msg/String\nPublisher count: 1\nSubscription count: 0\n"
    )
    cli("info", "/chatter", "-v")
    assert "Node: /robot  type: std_msgs/String  md5: 992ce8a1" in capsys.readouterr().out
    cli("type", "chatter")
    assert capsys.readouterr().out == "std_msgs/msg/String\n"
    cli("type", "chatter", "--json")
    assert json.loads(capsys.readouterr().out) == ["std_msgs/msg/String"]


def test_unknown_topic_is_named_with_those_there_are(cli, robot, capsys):
    with Publisher("chatter", String, node=robot):
        check_unknown_topic(cli, capsys)


def check_unknown_topic(cli, capsys):
    for words in (("type", "nope"), ("info", "nope"), ("echo", "nope")):
        assert cli(*words) == 2
        error = capsys.readouterr().err
        assert "topic '/nope': not there within 2 s; expected one of ['/chatter']" in error
    assert cli("info", "a b") == 2
    assert "invalid topic name" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("flags", "shown"),
    [
        ([], 'data: "hello"\n---\n'),
        (["--csv"], "hello\n"),
        (["--json"], '{"data": "hello"}\n'),
        (["--field", "data"], '"hello"\n---\n'),
        (["--no-str"], 'data: "<string length: 5>"\n---\n'),
        (["--flow-style"], '{data: "hello"}\n---\n'),
        (["-l", "3"], 'data: "hel..."\n---\n'),
        (["--raw"], "b'\\x05\\x00\\x00\\x00hello'\n---\n"),
    ],
)
def test_echo_once(cli, robot, capsys, flags, shown):
    Publisher("chatter", String, latch=True, node=robot).publish("hello")
    assert cli("echo", "chatter", "--once", *flags) == 0
    assert capsys.readouterr().out == shown


def test_echo_counts_and_times_out(cli, robot, capsys, clock):
    publisher = Publisher("count", Int32, node=robot)

    def publish():
        for number in range(3):
            clock.sleep(1)
            publisher.publish(number)

    clock.spawn(publish, name="robot")
    assert cli("echo", "count", "-n", "2", "--csv") == 0
    assert capsys.readouterr().out == "0\n1\n"
    assert cli("echo", "count", "std_msgs/Int32", "--csv", "--timeout", "5") == 1
    captured = capsys.readouterr()
    assert captured.out == "2\n"
    assert "/count: no message in 5 s" in captured.err


def test_echo_drops_the_oldest_messages_when_its_output_is_read_slowly(
    cli, robot, capsys, clock, monkeypatch
):
    """`actionlib topic echo images | less` kept all of them in memory."""
    publisher = Publisher("text", String, node=robot)
    clock.call_later(1.0, lambda: publisher.publish("0"))

    def publish_many(text, *_arguments, **_options):
        shown.append(text[:1])
        for number in range(1, 6 if len(shown) == 1 else 1):
            publisher.publish(str(number) * 10 * 2**20)  # 10 MiB; 32 MiB wait at most
            clock.sleep(0.1)
        clock.sleep(1.0)

    shown = []
    monkeypatch.setattr(MessageText, "format", lambda _self, message: message.data)
    monkeypatch.setattr(topic, "print", publish_many, raising=False)
    assert cli("echo", "text", "std_msgs/String", "-n", "4") == 0
    assert shown == ["0", "3", "4", "5"]
    dropped = "actionlib: 2 messages were dropped: they came faster than they were read\n"
    assert capsys.readouterr().err == dropped


def test_echo_of_a_field_that_is_not_there(cli, robot, capsys):
    Publisher("pose", PoseStamped, latch=True, node=robot).publish()
    assert cli("echo", "pose", "--once", "--field", "pose.position.q") == 2
    assert "'q' is not there; there are ['x', 'y', 'z']" in capsys.readouterr().err
    assert cli("echo", "pose", "--once", "--field", "pose..x") == 2
    assert "field path: malformed at 4" in capsys.readouterr().err
    long = f"data[{'1' * 5000}]"  # Python converts no integer of so many digits
    assert cli("echo", "chatter", "--field", long, "--once") == 2
    assert "field path: malformed at 4" in capsys.readouterr().err


def test_echo_shortens_long_arrays_unless_told_not_to(cli, robot, capsys):
    Publisher("scan", LaserScan, latch=True, node=robot).publish(ranges=[1.0] * 200)
    cli("echo", "scan", "--once", "--field", "ranges", "--csv")
    assert capsys.readouterr().out.count("1.0") == 128
    cli("echo", "scan", "--once", "--field", "ranges", "--csv", "-f")
    assert capsys.readouterr().out.count("1.0") == 200
    cli("echo", "scan", "--once", "--no-arr")
    assert 'ranges: "<array length: 200>"' in capsys.readouterr().out


def test_echo_of_what_passes_a_filter(cli, robot, capsys, clock):
    publisher = Publisher("count", Int32, node=robot)

    def publish():
        for number in range(10):
            clock.sleep(1)
            publisher.publish(number)

    clock.spawn(publish, name="robot")
    assert cli("echo", "count", "--filter", "data % 3 == 0", "-n", "3", "--csv") == 0
    assert capsys.readouterr().out == "0\n3\n6\n"
    assert cli("echo", "count", "--filter", "data > 9", "--timeout", "5") == 1
    assert "/count: no message that passes the filter in 5 s" in capsys.readouterr().err


def test_echo_with_a_filter_that_does_not_fit(cli, robot, capsys):
    Publisher("chatter", String, latch=True, node=robot).publish("hello")
    assert cli("echo", "chatter", "--filter", "dat == 3") == 2
    assert "'dat' is not there; there are ['data']" in capsys.readouterr().err
    assert cli("echo", "chatter", "--filter", "print(data)") == 2
    assert "this call is not allowed" in capsys.readouterr().err
    assert cli("echo", "chatter", "--filter", "data == 3", "--raw") == 2
    assert "got --filter beside --raw" in capsys.readouterr().err


def test_pub_waits_for_a_subscriber_and_publishes(cli, robot, capsys, clock):
    heard = []
    clock.call_later(3.0, lambda: Subscriber("point", Point, heard.append, node=robot))
    assert cli("pub", "point", "geometry_msgs/msg/Point", "{x: 1.0}", "-1") == 0
    clock.sleep(1)
    assert heard == [Point(x=1.0)]
    assert capsys.readouterr().out.splitlines()[:3] == [
        "Waiting for at least 1 matching subscription(s)...",
        "publisher: beginning loop",
        "publishing #1: Point(x=1.0, y=0.0, z=0.0)",
    ]


def test_pub_keeps_its_rate(cli, robot, clock, capsys):
    times = []
    Subscriber("chatter", String, lambda _: times.append(round(clock.now(), 6)), node=robot)
    start = clock.now()
    assert cli("pub", "chatter", "std_msgs/String", "data: x", "-r", "4", "-t", "5", "--json") == 0
    clock.sleep(1)
    assert times == [start + n * 0.25 for n in range(5)]
    assert capsys.readouterr().out == '{"data": "x"}\n' * 5


def test_pub_from_standard_input(cli, robot, clock, monkeypatch):
    heard = []
    Subscriber("chatter", String, heard.append, node=robot)
    monkeypatch.setattr(sys, "stdin", io.StringIO("data: a\n---\ndata: b\n---\n"))
    assert cli("pub", "chatter", "std_msgs/String", "--stdin") == 0
    clock.sleep(1)
    assert heard == [String("a"), String("b")]


def test_pub_from_standard_input_takes_no_more_than_it_is_told(cli, robot, clock, monkeypatch):
    heard = []
    Subscriber("chatter", String, heard.append, node=robot)
    for words, count in ((("-1",), 1), (("-t", "2"), 2)):
        monkeypatch.setattr(sys, "stdin", io.StringIO("data: a\n---\n" * 3))
        assert cli("pub", "chatter", "std_msgs/String", "--stdin", *words) == 0
        clock.sleep(1)
        assert heard == [String("a")] * count
        heard.clear()


@pytest.mark.parametrize("words", [["data: b"], ["--rate", "5"]])
def test_pub_refuses_what_standard_input_makes_void(cli, capsys, words):
    assert cli("pub", "chatter", "std_msgs/String", *words, "--stdin") == 2
    assert "beside --stdin; expected one of the two" in capsys.readouterr().err


def test_pub_tells_what_is_wrong(cli, capsys):
    assert cli("pub", "chatter", "std_msgs/String", "{date: x}", "-1") == 2
    assert "date" in capsys.readouterr().err
    assert cli("pub", "chatter", "std_msgs/Strin", "{}", "-1") == 2
    assert "String" in capsys.readouterr().err
    assert cli("pub", "chatter", "std_msgs/String", "{}", "-1", "--timeout", "2") == 2
    assert "no 1 subscribers in 2 s" in capsys.readouterr().err


def test_hz(cli, robot, clock, capsys):
    publisher = Publisher("chatter", String, node=robot)

    def publish():
        for _ in range(100):
            publisher.publish("x")
            clock.sleep(0.1)

    clock.spawn(publish, name="robot")
    assert cli("hz", "chatter", "-n", "2") == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "average rate: 10.000"
    assert lines[1].startswith("\tmin: 0.100s max: 0.100s std dev: 0.00000s window: ")
    assert cli("hz", "nothing", "-n", "1", "--json") == 0
    assert "no new messages" in capsys.readouterr().err


def test_bw(cli, robot, clock, capsys):
    publisher = Publisher("chatter", String, node=robot)

    def publish():
        for _ in range(100):
            clock.sleep(0.05)
            publisher.publish("x" * 996)  # and four bytes that say how many
            clock.sleep(0.05)

    clock.spawn(publish, name="robot")
    assert cli("bw", "chatter", "-n", "1") == 0
    assert capsys.readouterr().out.splitlines() == [
        "10.00 KB/s from 10 messages",
        "\tMessage size mean: 1.00 KB min: 1.00 KB max: 1.00 KB",
    ]
    assert cli("bw", "chatter", "-n", "1", "-w", "5", "--json") == 0
    record = json.loads(capsys.readouterr().out)
    assert record.pop("bytes_per_s") == pytest.approx(10_000)
    assert record == {"mean": 1000, "min": 1000, "max": 1000, "window": 5}


@pytest.mark.parametrize("verb", ["hz", "bw"])
def test_rates_of_a_publisher_that_speaks_only_when_heard(cli, robot, clock, capsys, verb):
    publisher = Publisher("chatter", String, node=robot)

    def publish():
        for _ in range(100):
            if publisher.get_num_connections():
                publisher.publish("x")
            clock.sleep(0.1)

    clock.spawn(publish, name="robot")
    assert cli(verb, "chatter", "-n", "3", "--json") == 0
    captured = capsys.readouterr()
    assert len(captured.out.splitlines()) == 3, captured.err
    clock.sleep(1.0)
    assert publisher.get_num_connections() == 0


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["pub", "a", "std_msgs/String", "{}", "-r", "0"], "'0'; expected a rate above 0"),
        (["pub", "a", "std_msgs/String", "{}", "-r", "nan"], "expected a rate above 0"),
        (["pub", "a", "std_msgs/String", "{}", "-t", "0"], "expected a whole number above 0"),
        (["pub", "a", "std_msgs/String", "{}", "-w", "x"], "expected 0 or more"),
        (["echo", "a", "--timeout", "-1"], "'-1'; expected seconds above 0"),
        (["echo", "a", "-n", "0"], "expected a whole number above 0"),
        (["hz", "a", "-n", "two"], "'two'; expected a whole number above 0"),
        (["bw", "a", "-w", "0"], "expected a whole number above 0"),
    ],
)
def test_numbers_that_are_no_use(cli, capsys, words, expected):
    with pytest.raises(SystemExit) as caught:
        cli(*words)
    assert caught.value.code == 2
    assert expected in capsys.readouterr().err


def test_a_name_nearby_is_suggested(cli, robot, capsys):
    assert cli("type", "chatter") == 2
    assert (
        "not there within 2 s; expected one, but there is none at all." in capsys.readouterr().err
    )
    with Publisher("chatter", String, node=robot):
        assert cli("type", "chater") == 2
    assert "Did you mean '/chatter'?" in capsys.readouterr().err


def test_a_name_that_comes_late_is_found(cli, robot, clock, capsys):
    clock.call_later(1.0, lambda: Publisher("chatter", String, node=robot))
    assert cli("type", "chatter") == 0
    assert capsys.readouterr().out == "std_msgs/msg/String\n"


@pytest.mark.parametrize(
    "value",
    [
        {"a": {"b": [1, 2.5], "c": "x: y"}, "d": [], "e": {}},
        {"list": [{"x": 1, "y": {"z": [1]}}, {"x": 2, "y": {"z": []}}], "t": True},
        [[1, 2], [3]],
        "text",
        {"nested": [[{"a": 1}], []]},
        {"inf": float("inf"), "minus": float("-inf"), "ü": "größe\n"},
    ],
)
@pytest.mark.parametrize("flow", [False, True])
def test_yaml_reads_back(value, flow):
    assert YAML(typ="safe", pure=True).load(to_yaml(value, flow=flow)) == value


def test_paths_and_cutting():
    assert split_path("pose.position[0].x") == ["pose", "position", 0, "x"]
    assert split_path("data[-1]") == ["data", -1]
    assert flatten({"a": [1, {"b": 2}], "c": 3}) == [1, 2, 3]
    assert shorten({"a": [1, 2, 3], "b": "abcd"}, 2, no_arr=False, no_str=False) == {
        "a": [1, 2, "..."], "b": "ab...",
    }  # fmt: skip
