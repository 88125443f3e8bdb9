"""The certificates and configurations of a fleet over the internet, with real TLS on this computer."""

from __future__ import annotations

import re
import subprocess
import sys

import pytest

from tests.free_port import free_port
from tests.places import DOCS

WAIT_S = 120
# `actionlib`, to which a busy router may say late why it refuses somebody.
PROGRAM = """
import sys
from actionlib_core.cli import main
from actionlib_core.transport import _refusal

_refusal.PROBE_S = 60.0
sys.exit(main())
"""


def file_of(page, name):
    text = (DOCS / page).read_text(encoding="utf-8")
    found = re.search(rf"<!-- file: {name} -->\n```\w+\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    assert found, name
    return found[1]


@pytest.fixture
def fleet(tmp_path):
    """`fleet(config, *words)` runs `actionlib` beside the router of the page; returns code and output."""
    port = free_port()

    program = file_of("howto/certificates.md", "make_certificates.py")
    (tmp_path / "make_certificates.py").write_text(program)
    router = file_of("deployments.md", "fleet_router.yaml").replace(
        "tls/0.0.0.0:7447", f"tls/127.0.0.1:{port}"
    )
    robot = file_of("deployments.md", "fleet_robot_1.yaml").replace(
        "tls/router.example.com:7447", f"tls/127.0.0.1:{port}"
    )
    (tmp_path / "router.yaml").write_text(router)
    (tmp_path / "robot_1.yaml").write_text(robot + f"connect_timeout: {WAIT_S}\n")
    for name in ("robot_2", "control_room", "stranger"):
        other = robot.replace("robot_1", name)
        if name == "control_room":
            other = other.replace("namespace: control_room\n", "")
        patience = 1 if name == "stranger" else WAIT_S
        (tmp_path / f"{name}.yaml").write_text(other + f"connect_timeout: {patience}\n")
    for names in (["fleet", "router", "robot_1", "robot_2", "control_room"], ["other", "stranger"]):
        command = [sys.executable, "make_certificates.py", *names]
        subprocess.run(command, cwd=tmp_path, check=True, timeout=WAIT_S)

    def start(*words):
        return subprocess.Popen(
            [sys.executable, "-c", PROGRAM, *words],
            cwd=tmp_path,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    serving = start("router", "--config", "router.yaml")
    said = serving.stdout.readline()

    def fleet(config, *words):
        running = start("--config", config, *words)
        try:
            return running.communicate(timeout=WAIT_S)[0], running.returncode
        finally:
            running.kill()
            running.communicate()

    try:
        assert f"tls/127.0.0.1:{port}" in said
        yield fleet
    finally:
        serving.kill()
        serving.communicate()


@pytest.mark.slow
@pytest.mark.zenoh
def test_certificates_decide_who_may_use_which_names(fleet):
    send = ("topic", "pub", "-1", "-w", "0")
    said, code = fleet("robot_1.yaml", *send, "battery", "std_msgs/Float32", "{data: 1.5}")
    assert code == 0, said
    said, code = fleet("robot_1.yaml", *send, "/robot_2/cmd_vel", "geometry_msgs/Twist", "{}")
    assert "robot_2/cmd_vel: access denied: got certificate 'robot_1'" in said
    assert code == 2
    said, code = fleet("control_room.yaml", *send, "/robot_2/cmd_vel", "geometry_msgs/Twist", "{}")
    assert code == 0, said
    said, code = fleet("stranger.yaml", "topic", "list")
    assert "it refuses us" in said
    assert code == 2
