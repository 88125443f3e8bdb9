"""A mission in a process of its own, for tests and measurements of the viewer.

    python robot.py [--name NAME] [--states N] [--rate HZ] [--runs N] [--control] [--hostile]
                    [--hold] [--ask SECONDS]

Prints "ready" when it can be found; ends when its standard input ends. With `--hold` it goes on in
TRANSPORT, and when it is preempted there, until a line on its standard input lets a state go.
"""

from __future__ import annotations

import argparse
import base64
import random
import sys
import threading

from actionlib_core.node import Node, use_node
from smachpy import CBState, Concurrence, IntrospectionServer, State, StateMachine, set_options
from smachpy.states.ask_operator import AskOperator

PNG = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)
GRACE_S = 600.0
OUTCOMES = ["succeeded", "aborted", "preempted"]
WORDS = ["TURN", "LIFT", "GRASP", "SCAN", "MOVE", "DOCK", "ALIGN", "READ", "PLACE", "CHECK"]


class Work(State):
    """Takes a while, and counts what it has done."""

    def __init__(self, pace, share=0.0, key="done"):
        super().__init__(outcomes=OUTCOMES, io_keys=[key])
        self.pace, self.share, self.key = pace, share, key
        self.random = random.Random(7)

    def execute(self, userdata):
        self.sleep(self.pace())
        if self.preempt_requested():
            return "preempted"
        userdata[self.key] = userdata[self.key] + 1 if self.key in userdata else 1
        return "aborted" if self.random.random() < self.share else "succeeded"


class Held(State):
    """Goes on until it is preempted, and then cleans up, or does not notice, until it is let go."""

    def __init__(self, *, notices):
        super().__init__(outcomes=OUTCOMES)
        self.notices = notices
        self.let_go = threading.Event()
        set_options(self, preempt_timeout=GRACE_S)

    def execute(self, userdata):
        self.sleep(3600.0)
        if self.notices:
            self.service_preempt()
        self.let_go.wait()
        return "preempted"


def small(pace, args):
    """INIT -> PICK (a machine) -> TRANSPORT (a concurrence) -> PLACE -> INIT ..."""
    sm = StateMachine(outcomes=OUTCOMES, name="DELIVER")
    sm.userdata.done = 0
    pick = StateMachine(outcomes=OUTCOMES, input_keys=["done"], output_keys=["done"])
    with pick:
        StateMachine.add("DETECT", Work(pace), {"succeeded": "APPROACH"})
        StateMachine.add("APPROACH", Work(pace), {"succeeded": "GRASP"})
        StateMachine.add("GRASP", Work(pace, 0.3), {"aborted": "DETECT"})
    transport = Concurrence(
        outcomes=OUTCOMES,
        default_outcome="aborted",
        input_keys=["done"],
        output_keys=["done"],
        outcome_map={"succeeded": {"NAVIGATE": "succeeded", "WATCH": "succeeded"}},
    )
    with transport:
        Concurrence.add("NAVIGATE", Held(notices=True) if args.hold else Work(pace))
        Concurrence.add("WATCH", Held(notices=False) if args.hold else Work(pace))
    with sm:
        StateMachine.add("INIT", Work(pace), {"succeeded": "PICK"})
        StateMachine.add("PICK", pick, {"succeeded": "TRANSPORT"})
        StateMachine.add("TRANSPORT", transport, {"succeeded": "PLACE"})
        StateMachine.add("PLACE", Work(pace), {"succeeded": "INIT"})
    return sm


def hostile(pace, args):
    """Names and values that want to break the page."""
    script = "<script>document.title='broken'</script>"
    names = [  # labels; outcomes and values may have slashes
        "<script>document.title='broken'",
        "A" * 10_000,
        "\u202e\u65e5\u672c\u8a9e \U0001f916",
        "\"quotes'`&amp;",
        "<title><img src=x onerror=alert(1)>",
    ]
    sm = StateMachine(outcomes=["succeeded", script], name="HOSTILE")

    class Mute:
        def __repr__(self):
            raise RuntimeError("no")

    def write(userdata):
        userdata.mute = Mute()
        userdata.big = list(range(100_000))
        userdata.markup = script
        userdata.lock = threading.Lock()
        return "succeeded"

    with sm:
        for i, name in enumerate(names):
            after = names[(i + 1) % len(names)]
            if i == 0:
                state = CBState(
                    write, outcomes=["succeeded"], output_keys=["mute", "big", "markup", "lock"]
                )
                StateMachine.add(name, state, {"succeeded": after})
            else:
                StateMachine.add(
                    name, Work(pace), {"succeeded": after, "aborted": script, "preempted": script}
                )
    return sm


def asking(pace, args):
    """Asks again and again, with a picture: by turns in two states, so that an answer stays on the page."""
    sm = StateMachine(outcomes=OUTCOMES, name="ERRAND")

    def ask(after):
        question = AskOperator(
            "Delivery to lab: may I hand it over?",
            {"yes": "Yes, hand over", "no": "No, come back"},
            patience=args.ask,
            picture=lambda _userdata: PNG,
        )
        return question, {"yes": after, "no": after, "no_answer": "aborted"}

    with sm:
        StateMachine.add("GO", Work(pace), {"succeeded": "CONFIRM"})
        StateMachine.add("CONFIRM", *ask("CONFIRM_AGAIN"))
        StateMachine.add("CONFIRM_AGAIN", *ask("GO"))
    return sm


def large(pace, args):
    """A machine of about `states` states, all of which loop for ever."""
    rng = random.Random(args.seed)
    count = iter(range(1, 100_000))

    def container(budget, depth):
        parallel = depth > 0 and rng.random() < 0.2
        children = []
        size = min(max(2, rng.randint(3, 7)), max(budget, 2))
        share = (budget - size) // size
        for _ in range(size):
            label = f"{rng.choice(WORDS)}_{next(count)}"
            if share >= 3 and depth < 6:
                children.append((label, container(share, depth + 1)))
            else:
                children.append((label, Work(pace, 0.1)))
        labels = [label for label, _ in children]
        if parallel:
            made = Concurrence(
                outcomes=OUTCOMES,
                default_outcome="aborted",
                input_keys=["done"],
                output_keys=["done"],
                outcome_map={"succeeded": dict.fromkeys(labels, "succeeded")},
            )
            with made:
                for label, state in children:
                    Concurrence.add(label, state)
            return made
        made = StateMachine(outcomes=OUTCOMES, input_keys=["done"], output_keys=["done"])
        with made:
            for i, (label, state) in enumerate(children):
                after = labels[i + 1] if i + 1 < size else "succeeded"
                StateMachine.add(
                    label, state, {"succeeded": after, "aborted": rng.choice(labels[: i + 1])}
                )
        return made

    sm = StateMachine(outcomes=OUTCOMES, name=f"FACTORY_{args.states}")
    sm.userdata.done = 0
    with sm:
        StateMachine.add("BOOT", Work(pace), {"succeeded": "SHIFT"})
        StateMachine.add(
            "SHIFT", container(args.states - 3, 0), {"succeeded": "BOOT", "aborted": "BOOT"}
        )
    return sm


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--name", default="robot")
    parser.add_argument("--states", type=int, default=0)
    parser.add_argument("--rate", type=float, default=5.0)
    parser.add_argument("--seed", type=int, default=4)
    parser.add_argument("--hold", action="store_true")
    parser.add_argument("--ask", type=float, default=0.0)
    parser.add_argument("--control", action="store_true")
    parser.add_argument("--hostile", action="store_true")
    args = parser.parse_args()

    def pace():
        return 1.0 / args.rate

    make = hostile if args.hostile else large if args.states else asking if args.ask else small
    machine = make(pace, args)
    with Node("robot") as node, use_node(node):
        server = IntrospectionServer(
            f"/{args.name}", machine, f"/{machine.name}", control=args.control
        )
        server.start()
        print("ready", flush=True)

        def end():
            held = machine["TRANSPORT"].get_children() if args.hold else {}
            for line in sys.stdin:
                held[line.strip()].let_go.set()
            machine.request_preempt()
            for state in held.values():
                state.let_go.set()

        threading.Thread(target=end, daemon=True).start()
        print(machine.execute(), flush=True)
        server.stop()


if __name__ == "__main__":
    main()
