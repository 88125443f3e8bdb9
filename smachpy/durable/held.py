"""The resources that a durable mission holds, for the missions of other processes.

They are rows of its store, which outlive the process as the goals of the mission do.
"""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from actionlib_core.resources import Policy
    from smachpy.durable.store import Lease, Store


class Held:
    """The resources of one mission in its store.

    Args:
        store: The store.
        lease: The mission's lease.
        robot: The robot that it uses, or None. A database is for many robots, each with resources
            of its own.

    All methods but `restore` may be called from any thread, and block until the store has answered.
    They raise StoreError and FencedError.
    """

    def __init__(self, store: Store, lease: Lease, robot: str | None) -> None:
        self._store = store
        self._lease = lease
        self._prefix = f"{robot}/" if robot and robot != "/" else ""
        self._lock = threading.Lock()
        # Of the process before this one, until the state takes it again: resource -> its path.
        self._before: dict[str, str] = {}
        self._stops: dict[str, Callable[[str], object]] = {}
        self._asked: set[tuple[str, str]] = set()  # resource and mission of those passed on

    def restore(self, visits: Mapping[str, Any]) -> None:
        """Keep what active states hold until they take it again; give the rest back."""
        own = [one for one in self._store.resources() if one.mission == self._lease.mission]
        self._before = {one.resource: one.state for one in own if one.holds}
        for one in own:
            if not one.holds:
                self._store.let_go(self._lease, one.resource)
        self.give_ended(visits)

    def give_ended(self, visits: Mapping[str, Any]) -> None:
        """Give back what states held that have ended and will not take it again."""
        if not self._before:
            return
        with self._lock:
            for resource, path in tuple(self._before.items()):
                visit = visits.get(path)
                if visit is None or visit["outcome"] is not None:
                    del self._before[resource]
                    self._store.let_go(self._lease, resource)

    def former(self, resource: str) -> str | None:
        """Return the state that held a resource before the resume, until it takes it again."""
        return self._before.get(self._name(resource)) if self._before else None

    def take(
        self, resource: str, state: str, policy: Policy, stop: Callable[[str], object]
    ) -> str | None:
        """Take a resource, or wait for it: then it is to be called again.

        Returns:
            Who is in the way, for people; None if the mission holds the resource.
        """
        resource = self._name(resource)
        with self._lock:
            user = self._store.hold(self._lease, resource, state, policy)
            if user is not None:
                return str(user)
            self._before.pop(resource, None)
            self._stops[resource] = stop
            return None

    def _name(self, resource: str) -> str:
        is_full = resource.startswith(self._prefix)
        return resource if is_full else f"{self._prefix}{resource}"

    def give(self, resource: str) -> None:
        """Give a resource back, or wait no longer."""
        resource = self._name(resource)
        with self._lock:
            self._stops.pop(resource, None)
            self._asked = {one for one in self._asked if one[0] != resource}
            self._store.let_go(self._lease, resource)

    def pass_on(self) -> None:
        """Ask the states that hold what a mission of another process takes to stop, each once."""
        if not self._stops:
            return
        for one in self._store.resources():
            with self._lock:
                stop = self._stops.get(one.resource)
                key = one.resource, one.mission
                is_new = one.urgent and not one.holds and key not in self._asked
                if stop is None or not is_new or one.mission == self._lease.mission:
                    continue
                self._asked.add(key)
            stop(str(one))
