"""Rules about userdata keys: read before written, written and never read.

A variable is a key in one container's userdata. A container copies its input keys in when it
begins, and its output keys out when it ends. A leaf is assumed to write all its output keys.
"""

from __future__ import annotations

from collections import deque
from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

from smachpy.checks.graph import moments

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from smachpy.checks.graph import Graph, GraphNode
    from smachpy.checks.model import Problem, Subject
    from smachpy.events.introspection import StateRecord

Variable: TypeAlias = tuple[str, str]  # path of the container, key
MAX_SHOWN_RUNS = 100  # problems that are shown with a run, which is as long as the machine
MAX_SEARCH_STEPS = 50_000  # the most moments in the search for a run that shows a problem


def find(subject: Subject, graph: Graph) -> Iterator[Problem]:
    """Yield the problems of the keys."""
    flow = _Flow(subject, graph)
    yield from flow.unset()
    yield from flow.unread()
    yield from _kept(subject, graph)


def _kept(subject: Subject, graph: Graph) -> Iterator[Problem]:
    """Yield the keys that a nested machine sets once and that its visits change for the next."""
    for record in subject.root.walk():
        kept = subject.facts_of(record).kept
        if not kept or record is subject.root:
            continue
        begins = graph.begins(record.path)
        ends = {n.number for n in graph.nodes if n.record is record and n.outcome is not None}
        if not begins & graph.reachable({a for end in ends for a in graph.after(end)}):
            continue  # no run gets to it twice
        for child in record.children:
            names = dict(child.remapping)
            for key in sorted({names.get(key, key) for key in child.output_keys} & kept):
                yield subject.problem(
                    "kept-value",
                    record,
                    f"{record.path} sets userdata key {key!r} once, before the run, and "
                    f"{child.label} writes it: a later visit begins with what the former one left.",
                    f"Give it a value for each visit: {record.label} = StateMachine(..., "
                    f"userdata={{{key!r}: ...}}).",
                )


class _Flow:
    """The variables that are certainly written at each moment.

    A forward data-flow analysis ("definite assignment"): a variable is written at a moment if it is
    written on every way there.
    """

    def __init__(self, subject: Subject, graph: Graph) -> None:
        self._subject = subject
        self._graph = graph
        self._parents = {c.path: r for r in subject.root.walk() for c in r.children}
        self._preset = frozenset(
            (record.path, key)
            for record in subject.root.walk()
            for key in subject.facts_of(record).preset
        )
        self._watched = {
            record.path for record in subject.root.walk() if subject.facts_of(record).watched
        }
        self._written = self._solve()

    # -- one moment ----------------------------------------------------------------------------

    def _outer(self, record: StateRecord, key: str) -> Variable | None:
        """Return the variable in the container around `record` for its `key`."""
        parent = self._parents.get(record.path)
        return None if parent is None else (parent.path, dict(record.remapping).get(key, key))

    def _pass(self, node: GraphNode, written: frozenset[Variable]) -> frozenset[Variable]:
        """Return the variables that are written after a moment."""
        record = node.record
        new: set[Variable] = set()
        if node.outcome is None and self._subject.facts_of(record).prepared:
            outers = (self._outer(record, key) for key in record.output_keys)
            new.update(outer for outer in outers if outer is not None)
        if node.outcome is None and record.is_container:
            for key in record.input_keys:
                outer = self._outer(record, key)
                if outer is None or outer in written | new or outer[0] in self._watched:
                    new.add((record.path, key))
            item_key = dict(record.details).get("item key")
            if record.kind == "iterator" and item_key is not None:
                new.add((record.path, item_key))
        elif node.outcome is not None:
            for key in record.output_keys:
                outer = self._outer(record, key)
                inner = record.path in self._watched or (record.path, key) in written
                if outer is not None and (inner or not record.is_container):
                    new.add(outer)
        return written | new if new else written

    def _solve(self) -> dict[int, frozenset[Variable]]:
        """Return the variables that are written before each moment, on every way to it."""
        graph = self._graph
        written = {graph.start: self._preset}
        queue = deque([graph.start])
        while queue:
            number = queue.popleft()
            after_it = self._pass(graph.nodes[number], written[number])
            for after in graph.after(number):
                # Where ways meet, only what is written on all of them counts. Sets only shrink, so
                # the loop ends.
                old = written.get(after)
                new = after_it if old is None else old & after_it
                if new != old:
                    written[after] = new
                    queue.append(after)
        return written

    def _may_be_written(self, variable: Variable, reader: StateRecord, key: str) -> bool:
        """Return whether `variable` is written at any moment of any run.

        Args:
            variable: The variable.
            reader: A leaf that reads it.
            key: Its name there.
        """
        if variable not in self._ever_written:
            return False
        if not reader.output_keys:  # what the others write is all that is written
            return True
        known = self._subject.facts_of(reader).reads
        others = {
            number
            for number in self._written
            if self._graph.nodes[number].record.path != reader.path
            or (known is not None and key in known.writes)
        }
        return variable in self._written_by(others)

    @cached_property
    def _ever_written(self) -> frozenset[Variable]:
        return self._written_by(self._written)

    def _written_by(self, numbers: Collection[int]) -> frozenset[Variable]:
        """Return the variables that are written at these moments, whatever their order."""
        ever: frozenset[Variable] = self._preset
        before: frozenset[Variable] | None = None
        while ever != before:
            before = ever
            for number in numbers:
                ever = self._pass(self._graph.nodes[number], ever)
        return ever

    # -- rules ---------------------------------------------------------------------------------

    def unset(self) -> Iterator[Problem]:
        reported: set[tuple[str, str]] = set()
        for number, written in sorted(self._written.items()):
            node = self._graph.nodes[number]
            reads = self._subject.facts_of(node.record).reads
            if node.outcome is not None or node.record.is_container or reads is None:
                continue
            for key in node.record.input_keys:
                variable = self._outer(node.record, key)
                if (
                    variable is None
                    or (node.record.path, key) in reported
                    or variable in self._pass(node, written)
                    or variable[0] in self._watched  # a callback may have written it
                    or variable[1] in self._subject.aside
                ):
                    continue
                sure = key in reads.always
                # A read in a branch may belong to runs in which the key was written before.
                if sure or (
                    key in reads.sometimes and not self._may_be_written(variable, node.record, key)
                ):
                    reported.add((node.record.path, key))
                    shows = len(reported) <= MAX_SHOWN_RUNS
                    yield self._unset(node, key, variable, sure=sure, shows=shows)

    def _unset(
        self, node: GraphNode, key: str, variable: Variable, *, sure: bool, shows: bool
    ) -> Problem:
        path = node.record.path
        alias = "" if variable[1] == key else f" ({key!r} there)"
        beside = self._beside(node.record, variable)
        later = f"; {beside} writes it, and may do so later" if beside else ""
        return self._subject.problem(
            "unset-key",
            node.record,
            f"{path} {'reads' if sure else 'may read'} userdata key {variable[1]!r}{alias} of "
            f"{variable[0]}, which nobody has written on this run{later}.",
            "Write it before, set it in the machine's userdata, or declare it as an input key "
            "of the machine.",
            severity="error" if sure and not beside else "warning",
            moments=moments(self._witness(node, variable)) if shows else (),
        )

    def _beside(self, record: StateRecord, variable: Variable) -> str:
        """Return the path of a parallel state that writes `variable`; "" if there is none."""
        path = record.path
        while (parent := self._parents.get(path)) is not None:
            if parent.kind == "concurrence":
                for child in parent.children:
                    if child.path != path and variable in self._writes(child):
                        return child.path
            path = parent.path
        return ""

    def _writes(self, record: StateRecord) -> Iterator[Variable]:
        """Yield the variables that a state, or a state in it, may write."""
        for state in record.walk():
            for key in state.output_keys:
                outer = self._outer(state, key)
                if outer is not None:
                    yield outer

    def _witness(self, goal: GraphNode, variable: Variable) -> list[GraphNode]:
        """Return a shortest run that reaches `goal` with `variable` unwritten."""
        graph = self._graph
        first = (graph.start, self._preset)
        came: dict[tuple[int, frozenset[Variable]], tuple[int, frozenset[Variable]] | None]
        came = {first: None}
        queue = deque([first])
        while queue and len(came) < MAX_SEARCH_STEPS:
            at = queue.popleft()
            if graph.nodes[at[0]].record.path == goal.record.path and variable not in at[1]:
                steps = [at]
                while (before := came[steps[-1]]) is not None:
                    steps.append(before)
                return [graph.nodes[number] for number, _ in reversed(steps)]
            written = self._pass(graph.nodes[at[0]], at[1])
            for after in graph.after(at[0]):
                if (after, written) not in came:
                    came[after, written] = at
                    queue.append((after, written))
        return graph.path([graph.start], {goal.number}) or []

    def unread(self) -> Iterator[Problem]:
        reached = {self._graph.nodes[number].record.path for number in self._written}
        seen = self._read()
        for record in self._subject.root.walk():
            for key in record.output_keys:
                variable = self._outer(record, key)
                if record.is_container or record.path not in reached or variable is None:
                    continue
                if variable in seen:
                    continue
                seen.add(variable)
                yield self._subject.problem(
                    "unread-key",
                    record,
                    f"{record.path} writes userdata key {variable[1]!r} of {variable[0]}, which no "
                    "state reads.",
                    "Remove it, read it, or declare it as an output key of the machine.",
                    # After the run the caller can look at the root's own userdata.
                    severity="note" if variable[0] == self._subject.root.path else None,
                )

    def _read(self) -> set[Variable]:
        """Return the variables that are read anywhere."""
        read: set[Variable] = set()
        for record in self._subject.root.walk():
            facts = self._subject.facts_of(record)
            parent = self._parents.get(record.path)
            if parent is not None:
                names = dict(record.remapping)
                read |= {(parent.path, names.get(key, key)) for key in record.input_keys}
            read |= {(record.path, key) for key in record.output_keys if record.is_container}
            if facts.watched:
                keys = [k for c in record.children for k in c.output_keys]
                names = {k: n for c in record.children for k, n in c.remapping}
                read |= {(record.path, names.get(key, key)) for key in keys}
        return read
