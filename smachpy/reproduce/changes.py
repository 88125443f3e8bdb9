"""What has changed since a recording was made: the machine, its constants, its files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from smachpy.events.code import file_hash, own_files

if TYPE_CHECKING:
    from collections.abc import Iterator

    from smachpy.events.introspection import StateRecord
    from smachpy.events.recording import Recording

MOST: Final = 12
"""Lines of one kind of change."""


def changes(recording: Recording, record: StateRecord, code: dict[str, Any]) -> Iterator[str]:
    """Yield the changes, the most telling ones first.

    Args:
        recording: The recording.
        record: The machine of today.
        code: `smachpy.events.code.code_facts` of today.
    """
    yield from _first(_of_machine(recording.record, record))
    before = (recording.origin or {}).get("code", {})
    # Of a module that is not loaded, because the mission is another file now, nothing is known.
    was_ = {
        key: value
        for key, value in before.get("constants", {}).items()
        if key.rpartition(".")[0] in code["files"]
    }
    yield from _first(_of_values(was_, code["constants"]))
    yield from _first(_of_files(before.get("files", {}), code["files"]))
    yield from _first(_of_values(before.get("versions", {}), code["versions"]))
    was, is_ = before.get("commit", ""), code["commit"]
    if was and was != is_:
        yield f"commit {is_[:10] or 'unknown'} now, was {was[:10]}"


def code_has_changed(recording: Recording) -> bool:
    """Return whether a file of the program is another one than it was."""
    before = (recording.origin or {}).get("code", {}).get("files", {})
    files = own_files()
    return any(name in files and file_hash(files[name]) != was for name, was in before.items())


def _first(found: Iterator[str]) -> Iterator[str]:
    lines = list(found)
    yield from lines[:MOST]
    if len(lines) > MOST:
        yield f"and {len(lines) - MOST} more"


def _of_machine(old: StateRecord, new: StateRecord) -> Iterator[str]:
    before = {state.path: state for state in old.walk()}
    now = {state.path: state for state in new.walk()}
    for path in before.keys() - now.keys():
        yield f"{path}: is gone"
    for path in now.keys() - before.keys():
        yield f"{path}: is new"
    for path in sorted(before.keys() & now.keys()):
        yield from _of_state(path, before[path], now[path])


def _of_state(path: str, old: StateRecord, new: StateRecord) -> Iterator[str]:
    details = dict(old.details), dict(new.details)
    for key, was, is_ in _pairs(*details):
        yield f"{path}: {key}: {is_ or 'nothing'} now, was {was or 'nothing'}"
    was_led, leads = _targets(old), _targets(new)
    for (source, outcome), was, is_ in _pairs(was_led, leads):
        words = f"{is_ or 'nowhere'} now, was {was or 'nowhere'}"
        yield f"{path}/{source}: {outcome} leads to {words}"
    for name in ("outcomes", "remapping", "initial"):
        was, is_ = getattr(old, name, None), getattr(new, name, None)
        if was != is_:
            yield f"{path}: {name}: {is_} now, was {was}"


def _targets(state: StateRecord) -> dict[Any, str]:
    return {(one.source, one.outcome): str(one.target) for one in state.transitions}


def _of_values(old: dict[str, Any], new: dict[str, Any]) -> Iterator[str]:
    for key, was, is_ in _pairs(old, new):
        if key in old:
            yield f"{key} is {is_ or 'gone'} now, was {was}"


def _of_files(old: dict[str, Any], new: dict[str, Any]) -> Iterator[str]:
    for name, now in sorted(new.items()):
        if old.get(name, now) != now:
            yield f"module {name} has changed"


def _pairs(old: dict[Any, Any], new: dict[Any, Any]) -> Iterator[tuple[Any, Any, Any]]:
    for key in dict.fromkeys([*old, *new]):
        if old.get(key) != new.get(key):
            yield key, old.get(key), new.get(key)
