"""An action client of the campaign: sends goals, cancels some, and writes down how each ended.

    python goal_client.py JOURNAL ACTION SEED PATIENCE

SIGUSR1: cancel every goal of its own, one by one; SIGUSR2: cancel all goals of all clients.
SIGHUP: its computer's clock is set. SIGTERM: send no more, wait for the end of each goal, leave.
"""

from __future__ import annotations

import queue
import random
import signal
import sys
import threading
import time

import wall
from journal import Journal

from actionlib_core import ActionClient, CommState, get_node
from actionlib_core.interfaces.actionlib.msg import TestAction, TestGoal

OUTSTANDING = 4
LONGEST_MS = 100
CANCELLED = 0.1  # share of the goals that are long and are cancelled
CANCELLED_MS = 10_000
SLOW = 0.01  # share of the feedback callbacks that block
SLOW_S = 0.3
LAST_S = 60.0  # longest wait for the last goals


class Client:
    def __init__(self, journal: Journal, action: str, seed: int, patience: float) -> None:
        self._journal = journal
        self._random = random.Random(seed)
        self._free = threading.Semaphore(OUTSTANDING)
        self._lock = threading.Lock()
        self._open: dict = {}
        self.commands: queue.SimpleQueue = queue.SimpleQueue()
        self.client = ActionClient(action, TestAction, server_lost_timeout=patience)

    def send_until(self, stop: list[int]) -> None:
        while not stop:
            self._obey()
            if self._free.acquire(timeout=0.05):
                self._send()

    def _obey(self) -> None:
        while not self.commands.empty():
            command = self.commands.get()
            with self._lock:
                handles = list(self._open.values())
            if command == signal.SIGUSR1:
                for handle in handles:
                    self._cancel(handle)
            else:
                self._journal.write("cancel all")
                self.client.cancel_all_goals()

    def _send(self) -> None:
        cancelled = self._random.random() < CANCELLED
        length = CANCELLED_MS if cancelled else self._random.randint(0, LONGEST_MS)
        delay = self._random.random() * 0.2
        with self._lock:
            handle = self.client.send_goal(TestGoal(length), self._on_change, self._on_feedback)
            self._open[handle.get_goal_id()] = handle
            self._journal.write("sent", id=handle.get_goal_id(), length=length)
        if cancelled:
            timer = threading.Timer(delay, self._cancel, [handle])
            timer.daemon = True
            timer.start()

    def _cancel(self, handle) -> None:
        self._journal.write("cancel", id=handle.get_goal_id())
        handle.cancel()

    def _on_feedback(self, handle, feedback) -> None:
        if self._random.random() < SLOW:
            time.sleep(SLOW_S)

    def _on_change(self, handle) -> None:
        if handle.get_comm_state() not in {CommState.DONE, CommState.LOST}:
            return
        goal_id, result = handle.get_goal_id(), handle.get_result()
        with self._lock:
            known = self._open.pop(goal_id, None) is not None
        self._journal.write(
            "done" if known else "done twice",
            id=goal_id,
            status=handle.get_terminal_state().name,
            text=handle.get_goal_status_text(),
            result=None if result is None else result.result,
        )
        self._free.release()

    def finish(self) -> None:
        for _ in range(OUTSTANDING):
            if not self._free.acquire(timeout=LAST_S):
                break
        with self._lock:
            for goal_id, handle in self._open.items():
                self._journal.write("never", id=goal_id, state=handle.get_comm_state().name)
        self.client.stop()


def main(path: str, action: str, seed: str, patience: str) -> None:
    journal = Journal(path)
    stop: list[int] = []
    client = Client(journal, action, int(seed), float(patience))
    signal.signal(signal.SIGTERM, lambda number, _: stop.append(number))
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for number in (signal.SIGUSR1, signal.SIGUSR2):
        signal.signal(number, lambda number, _: client.commands.put(number))
    wall.set_on(signal.SIGHUP, int(seed))
    journal.write("session", session=get_node().transport.session_id)
    print("up", flush=True)
    client.send_until(stop)
    client.finish()
    journal.write("end")


if __name__ == "__main__":
    main(*sys.argv[1:])
