"""An action server of the campaign: runs each goal for as many milliseconds as it says.

    python goal_server.py JOURNAL ACTION SEED

Some of its callbacks are slow. SIGTERM and SIGHUP stop it in good order, by the handlers of the
library; SIGUSR1 sets its computer's clock.
"""

from __future__ import annotations

import heapq
import random
import signal
import sys
import threading
import time

import wall
from journal import Journal

from actionlib_core import ActionServer, get_node, shutdown
from actionlib_core.exceptions import ActionException, ServerConflictError
from actionlib_core.interfaces.actionlib.msg import TestAction, TestFeedback, TestResult

SLOW = 0.01  # share of the goal callbacks that block
SLOW_S = 0.3
PREEMPTED, SUCCEEDED = 2, 3


class Server:
    def __init__(self, journal: Journal, action: str, seed: int) -> None:
        self._journal = journal
        self._random = random.Random(seed)
        self._changed = threading.Condition()
        self._running: list[tuple[float, int, object]] = []
        self._count = 0
        self.server = ActionServer(action, TestAction, self._on_goal, self._on_cancel, False)

    def start(self) -> None:
        threading.Thread(target=self._end_goals, daemon=True).start()
        self._journal.write("session", session=get_node().transport.session_id)
        self.server.start()

    def _on_goal(self, handle) -> None:
        self._journal.write("exec", id=handle.get_goal_id().id)
        handle.set_accepted()
        if self._random.random() < 0.3:
            handle.publish_feedback(TestFeedback(1))
        with self._changed:
            self._count += 1
            end = time.monotonic() + handle.get_goal().goal / 1000
            heapq.heappush(self._running, (end, self._count, handle))
            self._changed.notify()
        if self._random.random() < SLOW:
            time.sleep(SLOW_S)

    def _on_cancel(self, handle) -> None:
        goal_id = handle.get_goal_id().id
        self._journal.write("cancel", id=goal_id)
        self._end(handle, goal_id, PREEMPTED)

    def _end_goals(self) -> None:
        while True:
            with self._changed:
                while not self._running or self._running[0][0] > time.monotonic():
                    left = self._running[0][0] - time.monotonic() if self._running else None
                    self._changed.wait(left if left is None else max(0.0, left))
                handle = heapq.heappop(self._running)[2]
            self._end(handle, handle.get_goal_id().id, SUCCEEDED)

    def _end(self, handle, goal_id: str, status: int) -> None:
        # Written before, as the process may be killed in between: only the client knows then.
        self._journal.write("ending", id=goal_id, status=status)
        try:
            if status == PREEMPTED:
                handle.set_canceled(TestResult(-1))
            else:
                handle.set_succeeded(TestResult(handle.get_goal().goal))
        except ActionException as error:  # the other of the two came first
            self._journal.write("not ended", id=goal_id, status=status, why=str(error))


def main(path: str, action: str, seed: str) -> None:
    journal = Journal(path)
    wall.set_on(signal.SIGUSR1, int(seed))
    with shutdown.handle_signals():
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        serve(Server(journal, action, int(seed)), journal)


def serve(server: Server, journal: Journal) -> None:
    try:
        server.start()
    except ServerConflictError:
        journal.write("name taken")
        return
    print("up", flush=True)
    while not shutdown.requested():
        time.sleep(0.1)
        if server.server.error is not None:
            journal.write("gave way")
            return
    journal.write("stopping")
    server.server.stop()
    journal.write("stopped")


if __name__ == "__main__":
    main(*sys.argv[1:])
