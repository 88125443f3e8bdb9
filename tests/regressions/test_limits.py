"""Each reader of files and wires refuses twice its limit, with little memory and in time.

The limits are those of the table in docs/security.md. Each reader runs in a process of its own
with a limit for its memory (as `ulimit -v`) and for its time.
"""

from __future__ import annotations

import re
import subprocess
import sys
import textwrap

import pytest

from tests.places import DOCS

MEMORY = 1_500_000_000  # address space [bytes], of which numpy and zenoh take 500,000,000
CPU_S = 60  # for a busy computer; each takes some seconds at most

PRELUDE = f"""
import resource, tempfile
from pathlib import Path
MEMORY, CPU_S = {MEMORY}, {CPU_S}
resource.setrlimit(resource.RLIMIT_NOFILE, (min(5000, resource.getrlimit(resource.RLIMIT_NOFILE)[1]),) * 2)
tmp = Path(tempfile.mkdtemp())
def reading(read, expected):
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_S, CPU_S))
    try:
        read()
    except Exception as error:
        text = str(error)
        assert len(text) < 20_000, len(text)
        assert expected in text, text
        print("refused")
def ends(link):
    try:
        return link.recv(1) == b""
    except ConnectionResetError:
        return True
def file(name, content):
    path = tmp / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path
"""

READERS = {
    "yaml: length": """
        from actionlib_core.inputs.yaml_text import MAX_YAML_LENGTH, load_yaml
        text = "- a\\n" * (2 * MAX_YAML_LENGTH // 4)
        reading(lambda: load_yaml(text), "characters; expected at most 1,000,000")
    """,
    "yaml: depth": """
        from actionlib_core.inputs.yaml_text import MAX_YAML_NESTING, load_yaml
        text = "[" * 2 * MAX_YAML_NESTING + "]" * 2 * MAX_YAML_NESTING
        reading(lambda: load_yaml(text), "nested too deeply")
    """,
    "mission files: each names the next one twice": """
        from smachpy.files import load
        for level in range(40):
            both = f"A: {{mission: m{level + 1}.yaml}}, B: {{mission: m{level + 1}.yaml}}"
            file(f"m{level}.yaml", f"outcomes: [done]\\nstates: {{{both}}}\\n")
        file("m40.yaml", "outcomes: [done]\\nstates: {A: {state: wait, with: {seconds: 1}, on: {preempted: done}}}\\n")
        reading(lambda: load(tmp / "m0.yaml"), "more than 1000 mission files")
    """,
    "yaml: aliases": """
        from actionlib_core.inputs.yaml_text import load_yaml
        lines = [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}' if i else 'x'] * 10)}]" for i in range(12)]
        reading(lambda: load_yaml("\\n".join(lines)), "aliases stand for more than 100000")
    """,
    "yaml: merged keys": """
        from actionlib_core.inputs.yaml_text import load_yaml
        lines = ["a: &a {k: 1}"]
        for i in range(12):
            names = ", ".join(["*a" if not i else f"*m{i - 1}"] * 9)
            lines.append(f"m{i}: &m{i} {{<<: [{names}]}}")
        reading(lambda: load_yaml("\\n".join(lines)), "aliases stand for more than 100000")
    """,
    "other tools: length": """
        from smachpy import load
        from smachpy.foreign import MAX_LENGTH
        path = file("m.xml", "<scxml>" + " " * 2 * MAX_LENGTH + "</scxml>")
        reading(lambda: load(path), "characters; expected at most 1,000,000")
    """,
    "other tools: depth": """
        from smachpy import load
        from smachpy.foreign.draft import MAX_DEPTH
        path = file("m.scxml", "<scxml>" + "<state>" * 2 * MAX_DEPTH)
        reading(lambda: load(path), "more than 50 elements inside each other")
    """,
    "other tools: elements": """
        from smachpy import load
        from smachpy.foreign.xml_text import MAX_ELEMENTS
        path = file("m.scxml", "<scxml>" + "<a/>" * 2 * MAX_ELEMENTS + "</scxml>")
        reading(lambda: load(path), "more than 20,000 elements")
    """,
    "other tools: entities": """
        from smachpy import load
        lines = [f'<!ENTITY a{i} "{f"&a{i - 1};" * 10 if i else "x"}">' for i in range(12)]
        text = f"<!DOCTYPE scxml [{''.join(lines)}]><scxml name='&a11;'/>"
        reading(lambda: load(file("m.scxml", text)), "got an entity or a DOCTYPE with one")
    """,
    "other tools: events of states around": """
        from smachpy import load
        events = "".join(f'<transition event="e{i}" target="X"/>' for i in range(9000))
        states = "".join(f'<state id="s{i}"/>' for i in range(9000))
        text = f'<scxml><state id="A">{events}{states}</state><final id="X"/></scxml>'
        reading(lambda: load(file("m.scxml", text)), "stands for more than 100,000 values")
    """,
    "other tools: keys of all machines": """
        from smachpy import load
        keys = "".join(f'<Key name="k{i}"/>' for i in range(9000))
        states = "".join(f'<State name="s{i}" class="S"/>' for i in range(9000))
        text = f'<StateMachine outcomes="x">{keys}{states}</StateMachine>'
        reading(lambda: load(file("m.xml", text)), "stands for more than 100,000 values")
    """,
    "other tools: names for lists of names": """
        from smachpy import load
        lines = ["a0 = [1, 1]"] + [f"a{i} = [{f'a{i - 1}, ' * 10}]" for i in range(1, 12)]
        body = "".join(f"        {line}\\n" for line in lines)
        text = f"import flexbe_core\\nclass A(Behavior):\\n    def create(self):\\n{body}"
        reading(lambda: load(file("a_sm.py", text)), "stands for more than 100,000 values")
    """,
    "other tools: brackets": """
        from smachpy import load
        text = f"class A(Behavior):\\n    def create(self):\\n        a = {'-' * 100_000}1\\n"
        reading(lambda: load(file("a_sm.py", text)), "")
    """,
    "yaml: a value inside itself": """
        from actionlib_core.inputs.yaml_text import load_yaml
        reading(lambda: load_yaml("a: &a [*a]"), "contains itself")
    """,
    "a file that people write": """
        from actionlib_core.inputs.checked_file import MAX_BYTES
        from smachpy.states.waypoints import load_route
        path = file("w.csv", b"x" * 2 * MAX_BYTES)
        reading(lambda: load_route(path), "more than 16,777,216 bytes")
    """,
    "a device that never ends": """
        from smachpy.sim.world_file import load_world
        reading(lambda: load_world(Path("/dev/zero")), "more than 16,777,216 bytes")
    """,
    "a toml file: depth": """
        from smachpy.checks.suppression import read_settings
        path = file("pyproject.toml", "a = " + "[" * 100_000)
        reading(lambda: read_settings(path), "nested too deeply")
    """,
    "a world: things": """
        from smachpy.sim.world_file import MAX_THINGS, load_world
        path = file("w.yaml", "docks:\\n" + "- {x: 1.0, y: 1.0}\\n" * 2 * MAX_THINGS)
        reading(lambda: load_world(path), "got 1000; expected at most 500")
    """,
    "a world: problems": """
        from smachpy.sim.world_file import load_world
        path = file("w.yaml", "robots:\\n" + "- {x: a, y: b, z: 1}\\n" * 400)
        reading(lambda: load_world(path), "more than 100 problems")
    """,
    "a map: pixels": """
        from PIL import Image
        from smachpy.places.occupancy import MAX_CELLS, load_map
        Image.new("L", (8000, 2 * MAX_CELLS // 8000), 255).save(tmp / "m.png")
        path = file("m.yaml", "image: m.png\\nresolution: 0.05\\norigin: [0, 0, 0]\\nnegate: 0\\n"
                    "occupied_thresh: 0.65\\nfree_thresh: 0.2\\n")
        reading(lambda: load_map(path), "expected at most 16,000,000 pixels")
    """,
    "a definition: size": """
        from actionlib_core.interfaces import add_path, get_message
        from actionlib_core.interfaces._sources import LARGEST_FILE
        (tmp / "big_msgs" / "msg").mkdir(parents=True)
        file("big_msgs/msg/Big.msg", "#" * 2 * LARGEST_FILE)
        add_path(tmp)
        reading(lambda: get_message("big_msgs/Big"), "more than 1,000,000 bytes")
    """,
    "a definition: fields": """
        from actionlib_core.interfaces import define_message
        from actionlib_core.interfaces._definition import MAX_FIELDS
        text = "\\n".join(f"int32 f{i}" for i in range(2 * MAX_FIELDS))
        reading(lambda: define_message("big_msgs/Big", text), "expected 10,000 at most")
    """,
    "a definition: nested fields": """
        from actionlib_core.interfaces import define_message
        define_message("big_msgs/M0", "\\n".join(f"int32 f{i}" for i in range(20)))
        def define():
            for n in range(1, 9):
                text = "\\n".join(f"M{n - 1} f{i}" for i in range(20))
                define_message(f"big_msgs/M{n}", text)
        reading(define, "expected 10,000 at most")
    """,
    "a plan: size": """
        from smachpy.pnp.pnml import LARGEST_FILE
        from smachpy.pnp.reading import read_net
        path = file("p.plan", "a; " * LARGEST_FILE)
        reading(lambda: read_net(path), "more than 2,000,000 bytes")
    """,
    "a plan: actions": """
        from smachpy.pnp.net import MAX_PARTS
        from smachpy.pnp.reading import read_net
        path = file("p.plan", "a; " * 2 * MAX_PARTS)
        reading(lambda: read_net(path), "got more than 20,000")
    """,
    "a plan: rules": """
        from smachpy.pnp.reading import read_net
        file("p.er", "".join(f"*if* c{i} *during* a *do* b; goal\\n" for i in range(2_000)))
        path = file("p.plan", "a; " * 2_000)
        reading(lambda: read_net(path), "got more than 20,000")
    """,
    "a plan: jumps to nowhere": """
        from smachpy.pnp.reading import read_net
        path = file("p.plan", " ".join(f"a; GOTO_l{i};" for i in range(3_000)))
        reading(lambda: read_net(path), "label")
    """,
    "a net in pnml: nodes": """
        from smachpy.pnp.reading import read_net
        places = "".join(f"<place id='p{i}'/>" for i in range(40_000))
        path = file("p.pnml", f"<pnml><net id='n'>{places}</net></pnml>")
        reading(lambda: read_net(path), "got more than 20,000")
    """,
    "a net in pnml: entities": """
        from smachpy.pnp.reading import read_net
        path = file("p.pnml", "<!DOCTYPE a [<!ENTITY a 'aa'>]><pnml>&a;</pnml>")
        reading(lambda: read_net(path), "has entities")
    """,
    "a package.xml: entities": """
        from smachpy.ros1.project import Project
        (tmp / "p" / "msg").mkdir(parents=True)
        more = "".join(f"<!ENTITY a{i} '{f'&a{i - 1};' * 10}'>" for i in range(1, 20))
        file("p/package.xml", f"<!DOCTYPE a [<!ENTITY a0 'x'>{more}]><package>&a19;</package>")
        script = file("p/s.py", "")
        reading(lambda: (Project(script), print("refused")), "")
    """,
    "json: length": """
        from actionlib_core.inputs.json_text import MAX_JSON_LENGTH, load_json
        text = '"' + "x" * 2 * MAX_JSON_LENGTH + '"'
        reading(lambda: load_json(text), "expected at most 32,000,000")
    """,
    "json: arrays": """
        from actionlib_core.inputs.json_text import MAX_JSON_PARTS, load_json
        text = "[" + "[]," * 2 * MAX_JSON_PARTS + "0]"
        reading(lambda: load_json(text), "expected at most 2,000,000")
    """,
    "json: depth": """
        from actionlib_core.inputs.json_text import MAX_JSON_NESTING, load_json
        reading(lambda: load_json("[" * 2 * MAX_JSON_NESTING + "]" * 2 * MAX_JSON_NESTING), "nested deeper than 100")
    """,
    "an event": """
        import json
        from smachpy.network.reading import MAX_EVENT_LENGTH, read_numbered_event
        text = json.dumps({"kind": "Left", "path": "/A", "outcome": "x" * 2 * MAX_EVENT_LENGTH})
        reading(lambda: read_numbered_event(text), "expected at most 2,000,000")
    """,
    "a history: events": """
        import json
        from dataclasses import asdict
        from smachpy import StateMachine, describe
        from smachpy.network.reading import MAX_EVENTS, read_history
        one = {"epoch": "", "description": asdict(describe(StateMachine(["a"], name="M")))}
        text = json.dumps({**one, "events": [0] * 2 * MAX_EVENTS})
        reading(lambda: read_history(text), "expected at most 50,000")
    """,
    "a map in a record": """
        import base64, json, zlib
        from smachpy.events.reading import MAX_CELLS
        from smachpy.network.reading import read_observation
        cells = base64.b64encode(zlib.compress(bytes(200_000_000))).decode()
        fields = {"kind": "Observed", "path": "", "stamp_ns": 0, "robot": "", "what": "map", "n": 1}
        fields |= {"resolution": 0.1, "origin": [0, 0, 0], "cells": cells}
        large = json.dumps({**fields, "width": 2000, "height": 2 * MAX_CELLS // 2000})
        reading(lambda: read_observation(large), "at most 4,000,000 cells")
        wrong = json.dumps({**fields, "width": 10, "height": 10})
        reading(lambda: read_observation(wrong), "expected 100 cells")
    """,
    "a recording: size": """
        import os
        from smachpy.events.recording import LARGEST, read_recording
        path = file("r.jsonl", "")
        os.truncate(path, 2 * LARGEST)
        reading(lambda: read_recording(path), "expected at most 1,000,000,000")
    """,
    "a recording: a line": """
        from smachpy.events.recording import MAX_LINE_LENGTH, read_recording
        path = file("r.jsonl", b"x" * 2 * MAX_LINE_LENGTH)
        reading(lambda: read_recording(path), "expected at most 32,000,000")
    """,
    "notes on a recording": """
        from smachpy_viz.runs.notes import MAX_NOTES, MAX_NOTES_LENGTH, read_notes
        path = file("r.notes.json", b" " * 2 * MAX_NOTES_LENGTH)
        reading(lambda: read_notes(path.with_name("r.jsonl")), "at most 1,000,000")
        path.write_text(f"[{','.join(['{}'] * 2 * MAX_NOTES)}]")
        reading(lambda: read_notes(path.with_name("r.jsonl")), "no notes")
    """,
    "a structure in a file": """
        from actionlib_core.inputs.json_text import MAX_JSON_LENGTH
        from smachpy_viz.cli import read_record
        path = file("m.json", b"[" * 2 * MAX_JSON_LENGTH)
        reading(lambda: read_record(str(path)), "more than 32,000,000 bytes")
    """,
    "a structure: depth": """
        from smachpy.events.introspection import MAX_NESTING, StateRecord
        text = '{"children": [' * MAX_NESTING
        reading(lambda: StateRecord.from_json(text), "nested deeper than 800")
    """,
    "userdata over the network": """
        from smachpy.userdata.json_text import loads
        text = '{"a": ' + '{"$tuple": [' * 500 + "]}" * 500 + "}"
        reading(lambda: loads(text), "nested deeper")
    """,
    "a command over the network": """
        from smachpy.network.remote_control import parse_command
        reading(lambda: parse_command('{"command": "' + "x" * 2_000_000), "at most 1,000,000")
    """,
    "a password": """
        from actionlib_core.config import LARGEST_SECRET, Config
        path = file("secret", "x" * 2 * LARGEST_SECRET)
        config = Config(user="a", password_file=str(path))
        reading(config.secret, "more than 10,000 bytes")
    """,
    "a secret": """
        from actionlib_core.config import LARGEST_SECRET
        from smachpy.command.arguments import Text, read_secret
        path = file("secret", "x" * 2 * LARGEST_SECRET)
        reading(lambda: read_secret(Text(f"@{path}"), "x", kept=True), "more than 10,000 bytes")
    """,
    "a journal: depth": """
        import sqlite3, zlib
        import smachpy
        from smachpy.durable.journal import MAX_STATE_DEPTH, read_position
        from smachpy.durable.mission import new_mission
        from smachpy.durable.opening import open_store
        machine = smachpy.StateMachine(["a"], name="M")
        machine.add("A", smachpy.CBState(lambda _: "a", outcomes=["a"]))
        store = open_store(tmp / "j.db")
        store.create(new_mission(machine, mission="m", target="x", argv=(), robot=None))
        deep = b"[" * 2 * MAX_STATE_DEPTH + b"]" * 2 * MAX_STATE_DEPTH
        with sqlite3.connect(tmp / "j.db") as other:
            other.execute("INSERT INTO smachpy_snapshots VALUES ('m', 1, ?, ?)", (zlib.crc32(deep), deep))
        reading(lambda: read_position(store, "m"), "nested deeper than 500 levels")
    """,
    "a journal: a value": """
        import sqlite3
        import smachpy
        from smachpy.durable.journal import read_position
        from smachpy.durable.mission import new_mission
        from smachpy.durable.sqlite import MAX_VALUE_BYTES
        from smachpy.durable.opening import open_store
        machine = smachpy.StateMachine(["a"], name="M")
        machine.add("A", smachpy.CBState(lambda _: "a", outcomes=["a"]))
        store = open_store(tmp / "j.db")
        store.create(new_mission(machine, mission="m", target="x", argv=(), robot=None))
        with sqlite3.connect(tmp / "j.db") as other:
            size = 2 * MAX_VALUE_BYTES
            other.execute("INSERT INTO smachpy_snapshots VALUES ('m', 1, 0, zeroblob(?))", (size,))
        reading(lambda: read_position(store, "m"), "a value has more than 268435456 bytes")
    """,
    "requests to the page: connections": """
        import socket, threading
        from urllib.request import urlopen
        from smachpy_viz.live.app import Viewer
        from smachpy_viz.live.machines import Machines
        from smachpy_viz.live.server import MAX_CONNECTIONS, PageServer
        server = PageServer(Viewer(Machines()), "127.0.0.1", 0)
        serving = threading.Thread(target=server.serve_here, daemon=True)
        serving.start()
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        links = [socket.create_connection(("127.0.0.1", server.port)) for _ in range(2 * MAX_CONNECTIONS)]
        for link in links[MAX_CONNECTIONS:]:
            link.settimeout(CPU_S)
            assert ends(link)
        for link in links:
            link.close()
        assert urlopen(f"http://127.0.0.1:{server.port}/", timeout=CPU_S).status == 200
        server.stop()
        serving.join(CPU_S)
        assert not serving.is_alive()
        print("refused")
    """,
    "connections of ROS 1": """
        import socket, threading
        from actionlib_core.clock import RealClock
        from actionlib_core.ros1.links import MAX_CONNECTIONS, TcpListener
        over = threading.Event()
        listener = TcpListener("127.0.0.1", RealClock(), "test", lambda sock, _: over.wait())
        links = [socket.create_connection(("127.0.0.1", listener.port)) for _ in range(2 * MAX_CONNECTIONS)]
        for link in links[MAX_CONNECTIONS:]:
            link.settimeout(CPU_S)
            assert ends(link)
        assert threading.active_count() <= MAX_CONNECTIONS + 10
        over.set()
        listener.close(CPU_S)
        print("refused")
    """,
    "a journal: a view that never ends": """
        import sqlite3
        from smachpy.durable.opening import open_store
        open_store(tmp / "j.db").close()
        with sqlite3.connect(tmp / "j.db") as other:
            other.execute("CREATE VIEW v AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i FROM n) SELECT * FROM n")
        reading(lambda: open_store(tmp / "j.db"), "got a journal with view v")
    """,
    "a header of ROS 1": """
        from actionlib_core.ros1.frames import LARGEST_HEADER, LENGTH, read_length
        raw = LENGTH.pack(2 * LARGEST_HEADER)
        reading(lambda: read_length(raw, LARGEST_HEADER), "expected at most 262144")
    """,
    "messages of ROS 1 together": """
        from actionlib_core.ros1.links import Budget
        budget = Budget(1000)
        def read():
            with budget.take(600, "/a"), budget.take(600, "/b"):
                pass
        reading(read, "got 600 bytes; expected fewer beside 600 of others")
    """,
    "a call of ROS 1: entities": """
        from actionlib_core.ros1.rpc import _check_plain
        text = "<!DOCTYPE a [<!ENTITY a 'aa'>]><methodCall/>"
        reading(lambda: _check_plain(text.encode("utf-16")), "got a document type")
        reading(lambda: _check_plain(text.encode()), "got a document type")
    """,
    "publishers of ROS 1": """
        from actionlib_core.ros1.publishers import MAX_PUBLISHERS, Publishers
        known = [f"http://known{i}" for i in range(50)]
        here = Publishers("http://us")
        here.update(known)
        change = here.update([*(f"http://x{i}" for i in range(9000)), *known])
        assert len(here.there) == MAX_PUBLISHERS and here.there >= set(known) and not change.give_up
        assert change.left_out == 9050 - MAX_PUBLISHERS
        print("refused")
    """,
}


@pytest.mark.slow
@pytest.mark.parametrize("reader", READERS)
def test_reader_refuses_twice_its_limit_with_little_memory_and_in_time(reader):
    code = PRELUDE + textwrap.dedent(READERS[reader])
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "refused" in done.stdout, done.stderr[-2000:]
    assert done.returncode == 0, done.stderr[-2000:]


TABLE = DOCS / "security.md"


def numbers_in(text):
    return {int(word.replace(",", "")) for word in re.findall(r"\d[\d,]*", text)}


def test_limits_in_the_docs_are_those_of_the_code():
    from actionlib_core.config import LARGEST_SECRET
    from actionlib_core.inputs import json_text, yaml_text
    from actionlib_core.inputs.checked_file import MAX_BYTES
    from actionlib_core.interfaces import _definition, _sources
    from actionlib_core.ros1 import frames, links, node, publishers, rpc
    from smachpy.durable import journal, sqlite, store
    from smachpy.events import reading, recording
    from smachpy.files.reading import MOST_FILES, MOST_PARTS
    from smachpy.foreign import draft, xml_text
    from smachpy.network import reading as network
    from smachpy.places import occupancy
    from smachpy.pnp import net, pnml
    from smachpy.sim import world_file
    from smachpy.states import questions
    from smachpy_viz.live import answers, machines, server, streams
    from smachpy_viz.runs import notes

    numbers = {
        *(
            yaml_text.MAX_YAML_LENGTH,
            yaml_text.MAX_YAML_NESTING,
            yaml_text.MAX_YAML_PARTS,
            MAX_BYTES,
        ),
        *(
            journal.MAX_STATE_DEPTH,
            sqlite.MAX_VALUE_BYTES,
            sqlite.DEADLINE_S,
            store.PAGE,
            LARGEST_SECRET,
        ),
        *(world_file.MAX_THINGS, occupancy.MAX_CELLS),
        *(MOST_FILES, MOST_PARTS),
        *(_sources.LARGEST_FILE, _definition.MAX_FIELDS, _definition.MAX_TYPE_NESTING),
        *(pnml.LARGEST_FILE, net.MAX_PARTS),
        *(draft.MAX_LENGTH, draft.MAX_VALUES, draft.MAX_NOTES, draft.MAX_DEPTH),
        xml_text.MAX_ELEMENTS,
        *(json_text.MAX_JSON_LENGTH, json_text.MAX_JSON_NESTING, json_text.MAX_JSON_PARTS),
        *(
            recording.LARGEST,
            recording.MAX_LINE_LENGTH,
            reading.MAX_CELLS,
            questions.MAX_PICTURE_BYTES,
        ),
        *(network.MAX_EVENT_LENGTH, network.MAX_OBSERVED_LENGTH, network.MAX_EVENTS),
        *(machines.MAX_MACHINES, machines.MAX_STATES, machines.MAX_TOTAL_BYTES),
        *(notes.MAX_NOTES_LENGTH, notes.LONGEST_NOTE, notes.MAX_NOTES),
        *(answers.MAX_COMMAND_LENGTH, server.REQUEST_S, server.MAX_CONNECTIONS),
        *(streams.MAX_STRANGERS, streams.MAX_STREAMS_PER_ADDRESS, streams.MAX_STREAMS),
        *(rpc.LARGEST_REQUEST, rpc.REQUEST_S, rpc.LARGEST_ANSWER, node.LARGEST_REQUEST),
        *(frames.LARGEST_HEADER, frames.LARGEST_MESSAGE, links.WHOLE_HEADER_S, node.AT_ONCE),
        *(links.MAX_CONNECTIONS, publishers.MAX_PUBLISHERS, node.MAX_LINKS),
    }
    part = TABLE.read_text(encoding="utf-8").partition("## Limits")[2].partition("\n## ")[0]
    assert {int(number) for number in numbers} <= numbers_in(part)
    bridge = (DOCS / "ros1_bridge.md").read_text(encoding="utf-8")
    assert {frames.LARGEST_HEADER, frames.LARGEST_MESSAGE} <= numbers_in(bridge)
