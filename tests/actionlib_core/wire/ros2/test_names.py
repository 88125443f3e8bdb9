"""Keys, tokens and quality of service of ROS 2 nodes: what real ones wrote, and every one of ours."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actionlib_core.transport._keys import check_key, key_matches
from actionlib_core.wire.ros2.names import (
    DEFAULT,
    LATCHED,
    NO_GOAL,
    ActionNames,
    Kind,
    Qos,
    Token,
    action_names,
    action_of,
    data_key,
    dds_type,
    gid_of,
    goal_id_text,
    goal_uuid,
    parse_qos,
    parse_token,
    qos_text,
    ros_type,
    token_key,
    token_pattern,
)
from tests.places import DATA

GOLDEN = [json.loads(line) for line in (DATA / "ros2_golden.jsonl").read_text().splitlines()]
TOKENS = [line for line in GOLDEN if line["kind"] == "token"]
KEYED = [line for line in GOLDEN if line["kind"] in {"message", "request"}]
SOMEBODY = Token(
    42,
    "0af1",
    0,
    8,
    Kind.SERVICE,
    "",
    "robot1",
    "nav",
    "robot1/fib",
    "a/srv/B",
    "RIHS01_1",
    LATCHED,
)

word = st.text("abXY_19", max_size=6).map("n".__add__)
name = st.lists(word, min_size=1, max_size=4).map("/".join)
type_name = st.builds("{}/{}/{}".format, word, st.sampled_from(["msg", "srv", "action"]), word)
number = st.integers(0, 2**31)
qos = st.builds(
    Qos,
    st.booleans(),
    st.booleans(),
    st.integers(0, 100),
    st.booleans(),
    st.sampled_from([",:,:,,", ",:10,0:,,", "1,2:3,4:3,5,6"]),
)
tokens = st.builds(
    Token,
    number,
    st.text("0123456789abcdef", min_size=1, max_size=32),
    number,
    number,
    st.sampled_from([kind for kind in Kind if kind is not Kind.NODE]),
    st.just("") | name,
    st.just("") | name,
    word,
    name,
    type_name,
    st.sampled_from([f"RIHS01_{7:064x}", "TypeHashNotSupported"]),
    qos,
)


def test_there_is_golden_data_of_every_kind() -> None:
    assert {line["values"]["kind"] for line in TOKENS} == {kind.value for kind in Kind}
    assert len(KEYED) > 30


@pytest.mark.parametrize("line", TOKENS, ids=[line["values"]["kind"] for line in TOKENS])
def test_tokens_of_real_nodes_read_and_write_back(line: dict) -> None:
    token = parse_token(line["key"])
    assert token is not None
    for part, value in line["values"].items():
        if part == "qos":
            assert qos_text(token.qos) == value
        elif part == "hash":
            assert token.type_hash == value
        elif part in {"enclave", "namespace", "name"}:
            assert "/" + getattr(token, part) == value
        elif part == "type":
            assert dds_type(token.type) == dds_type(ros_type(value))
        else:
            assert getattr(token, part) == value
    assert token_key(token) == line["key"]
    assert gid_of(line["key"]).hex() == line["gid"]


@pytest.mark.parametrize("line", KEYED, ids=[line["type"] for line in KEYED])
def test_keys_of_real_messages(line: dict) -> None:
    domain, *words, dds, type_hash = line["key"].split("/")
    assert data_key(int(domain), "/".join(words), ros_type(dds), type_hash) == line["key"]


@given(tokens)
def test_a_token_survives_the_way_through_its_key(token: Token) -> None:
    key = token_key(token)
    assert parse_token(key) == token
    assert parse_token(f"{key}/backends:cuda:1;") == token
    check_key(key)
    for pattern in (
        token_pattern(token.domain),
        token_pattern(token.domain, token.kind),
        token_pattern(token.domain, name=token.name),
        token_pattern(token.domain, token.kind, name=token.name),
    ):
        assert key_matches(pattern, key)
    assert not key_matches(token_pattern(token.domain + 1), key)
    assert not key_matches(token_pattern(token.domain, name=token.name + "x"), key)


@given(tokens)
def test_a_node_has_a_token_of_its_own(token: Token) -> None:
    node = Token(*token[:4], Kind.NODE, *token[5:8])
    key = token_key(node)
    assert parse_token(key) == node
    assert key_matches(token_pattern(node.domain, Kind.NODE), key)
    assert key_matches(token_pattern(node.domain), key)


@given(number, name, type_name)
def test_keys_are_keys(domain: int, full_name: str, full_type: str) -> None:
    key = data_key(domain, full_name, full_type, "RIHS01_0")
    check_key(key)
    assert ros_type(dds_type(full_type)) == full_type
    assert key == f"{domain}/{full_name}/{dds_type(full_type)}/RIHS01_0"


@given(st.text() | st.lists(st.text(max_size=6), max_size=14).map("/".join))
def test_any_text_is_a_token_or_none(text: str) -> None:
    assert parse_token(text) is None
    parse_token("@ros2_lv/0/a/0/0/SS/%/%/" + text)
    parse_qos(text)


@pytest.mark.parametrize("key", [
    "@ros2_lv/42/a/0/0/XX/%/%/n",
    "@ros2_lv/-1/a/0/0/NN/%/%/n",
    "@ros2_lv/42/a/0/\u0664/NN/%/%/n",
    "@ros2_lv/42/a/0/0/NN/%/%/",
    "@ros2_lv/42//0/0/NN/%/%/n",
    "@ros2_lv/42/a/0/0/SS/%/%/n/%x/T",
    "@ros2_lv/42/a/0/0/SS/%/%/n/%x//h/::,10:,:,:,,",
    "@other/42/a/0/0/NN/%/%/n",
    f"@ros2_lv/{9:0>5000}/a/0/0/NN/%/%/n",
    f"@ros2_lv/42/a/0/{9:0>5000}/NN/%/%/n",
    "@ros2_lv/42/a/0/0/NN/%/%/n\nproblem",
    "@ros2_lv/42/a/0/0/SS/%/%/n/%x\x1b[31m/T/h/::,10:,:,:,,",
    "@ros2_lv/42/a/0/0/SS/%/%/n/%x\u202e/T/h/::,10:,:,:,,",
])  # fmt: skip
def test_what_is_no_token(key: str) -> None:
    assert parse_token(key) is None


def test_quality_of_service_that_nobody_could_have_written() -> None:
    assert parse_qos(f"::,{9:0>5000}:,:,:,,") is None


@pytest.mark.parametrize(("part", "value"), [
    ("domain", -1), ("session", ""), ("session", "a/b"), ("node_id", -1), ("entity_id", -1),
    ("node", ""), ("node", "a/b"), ("node", "a%b"), ("node", "@a"), ("namespace", "a//b"),
    ("namespace", "/a"), ("name", ""), ("name", "a/"), ("name", "**"), ("name", "a$b"),
    ("type", "msg/B"), ("type", "a/msg/B C"), ("type_hash", ""), ("type_hash", "a#b"), ("enclave", "a\nb"),
])  # fmt: skip
def test_a_token_that_no_node_could_read_is_not_made(part: str, value: object) -> None:
    with pytest.raises(ValueError, match="expected"):
        token_key(SOMEBODY._replace(**{part: value}))


@pytest.mark.parametrize("full_name", ["", "/a", "a/", "a//b", "a/*", "a b", "a/@b", "\u00e4"])
def test_a_key_that_no_node_could_read_is_not_made(full_name: str) -> None:
    with pytest.raises(ValueError, match="name: got"):
        data_key(0, full_name, "a/msg/B", "RIHS01_0")


@pytest.mark.parametrize(("quality", "text"), [
    (DEFAULT, "::,10:,:,:,,"),
    (LATCHED, ":1:,1:,:,:,,"),
    (Qos(reliable=False, depth=5), "2::,5:,:,:,,"),
    (Qos(latched=True, depth=1000, rest=",:10,0:,,"), ":1:,1000:,:10,0:,,"),
    (Qos(depth=42, keep_all=True), "::2,:,:,:,,"),
])  # fmt: skip
def test_quality_of_service(quality: Qos, text: str) -> None:
    assert qos_text(quality) == text
    assert parse_qos(text) == quality


@pytest.mark.parametrize(
    "quality", [Qos(depth=-1), Qos(rest=""), Qos(rest="/:,:,,"), Qos(rest=",:$,:,,")]
)
def test_quality_that_no_node_writes_is_not_made(quality: Qos) -> None:
    with pytest.raises(ValueError, match="expected"):
        qos_text(quality)


@given(qos)
def test_quality_of_service_survives(quality: Qos) -> None:
    assert parse_qos(qos_text(quality)) == quality


def test_the_parts_of_an_action() -> None:
    names = action_names("robot1/fib")
    assert names.send_goal == "robot1/fib/_action/send_goal"
    assert {action_of(part) for part in names} == {"robot1/fib"}
    assert ActionNames._fields == ("send_goal", "cancel_goal", "get_result", "feedback", "status")
    assert action_of("fib") is None
    assert action_of("fib/_action/other") is None
    assert action_of("/_action/status") is None


@given(st.text())
def test_a_goal_id_is_always_the_same_16_bytes_and_never_those_of_all_goals(goal_id: str) -> None:
    uuid = goal_uuid(goal_id)
    assert len(uuid) == 16
    assert uuid != NO_GOAL
    assert goal_uuid(goal_id_text(uuid)) == uuid


@given(st.binary(min_size=16, max_size=16))
def test_an_id_from_elsewhere_comes_back(uuid: bytes) -> None:
    assert (goal_uuid(goal_id_text(uuid)) == uuid) == (uuid != NO_GOAL)


def test_the_id_of_no_goal_is_not_produced() -> None:
    assert goal_uuid("00" * 16) != NO_GOAL
    assert goal_uuid("\ud800") != NO_GOAL
