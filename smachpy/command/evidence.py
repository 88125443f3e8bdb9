"""Evidence: what was tried with a mission before it may drive a robot.

`smachpy certify` writes it, one JSON file. `smachpy run` and `smachpy runner` with
`--require-evidence` run only missions whose hash is that of a good one. A run says what there is in
a note of its machine, and in others what it does that nobody has tried: the engine knows notes, and
no evidence. The file is not signed: whoever may write it may say what he likes, as with the code.
"""

from __future__ import annotations

import ast
import contextlib
import hashlib
import json
import marshal
import platform
import struct
import sys
import sysconfig
from dataclasses import dataclass
from importlib.machinery import PathFinder
from importlib.metadata import version
from importlib.util import MAGIC_NUMBER, cache_from_source
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, TypedDict

from actionlib_core.inputs.checked_data import checked
from actionlib_core.inputs.checked_file import read_limited
from actionlib_core.inputs.json_text import load_json
from actionlib_core.process.output import printable
from smachpy.command.targets import DATA, TargetError, is_data, names_file
from smachpy.events import Left, Noted, Recovered, Started
from smachpy.exceptions import SmachError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from smachpy.command.targets import Target
    from smachpy.events import Event
    from smachpy.machines.container import Container

FORMAT: Final = "smachpy-evidence"
VERSION: Final = 1
LARGEST: Final = 20_000_000
"""Largest file that is read [bytes]."""

MAX_FILES: Final = 2_000
"""Largest number of files of a mission: all of them are in its hash."""

LIBRARY: Final = ("actionlib_core", "smachpy")

_CODE: Final = 16  # where code begins in a file of bytecode [bytes]

NOTE: Final = "evidence: "
"""How the notes of a run begin that say what evidence it has."""


class EvidenceError(SmachError):
    """There is no evidence for a mission, or it cannot be read or written.

    Try: `smachpy certify MISSION -o evidence.json`, and `--require-evidence evidence.json`.
    """


class _Hashed(TypedDict):
    hash: str


class _Taken(TypedDict):
    explored: list[str]
    simulated: list[str]
    recorded: list[str]


class _Evidence(TypedDict):
    format: Literal["smachpy-evidence"]
    version: Literal[1]
    ok: bool
    mission: _Hashed
    library: _Hashed
    taken: _Taken


@dataclass(frozen=True, slots=True)
class Seal:
    """What evidence there is of a mission.

    Attributes:
        is_valid: It is good, and for this mission and this library.
        text: What there is, in words.
        taken: The transitions that were taken with these files of the mission; None if there is no
            evidence of them.
    """

    is_valid: bool
    text: str
    taken: frozenset[str] | None = None

    def watch(self, machine: Container) -> Callable[[], None]:
        """Say in notes of the machine what there is, and once each what nobody has tried.

        Returns:
            A function that ends it.
        """
        said: set[str] = set()
        root = unsaid = ""

        def note(frame: Any, text: str) -> None:
            with frame.run.lock:  # published before the next event, also for later listeners
                frame.note(root, Noted, f"{NOTE}{text}")

        def on_event(event: Event) -> None:
            nonlocal root, unsaid
            if isinstance(event, Started | Recovered):
                root, unsaid = event.path, self.text
            frame = machine._smachpy.live.root
            if frame is None:  # the run begins, or has ended
                return
            if unsaid:
                text, unsaid = unsaid, ""
                note(frame, text)
            if isinstance(event, Left) and self.taken is not None:
                taken = transition_text(event.path, event.outcome)
                if taken not in self.taken and taken not in said:
                    said.add(taken)
                    note(frame, f"nothing that was tried has taken {taken}")

        return machine.subscribe(on_event)


def transition_text(path: str, outcome: str) -> str:
    """Return a transition as evidence lists it."""
    return f"{path} -{outcome}->"


def transitions_of(records: Iterable[dict[str, Any]]) -> set[str]:
    """Return the transitions that the events of a recording take."""
    return {transition_text(e["path"], e["outcome"]) for e in records if e["kind"] == "Left"}


def mission_facts(target: Target, text: str) -> dict[str, Any]:
    """Return what identifies a mission: its `name` in a file, its `files` with their hashes.

    `hash` is that of all this. The files are the module in which it is, and those which that
    imports, however deep: not modules of Python, of this library and of other installed packages.
    Of a mission file or a plan it is the file, with all such files and modules below its folder,
    and what these import.

    Args:
        target: The mission.
        text: As the user named it.

    Raises:
        TargetError: its module has no file, or it has more than `MAX_FILES`, or Python takes other
            bytecode for one of them, which is deleted.
    """
    place = text.partition(":")[0]
    if is_data(place):
        folder = Path(place).parent.resolve()  # of a link, as its states are looked up
        found = [
            path
            for path in sorted(folder.rglob("*"))
            if path.suffix in {*DATA, ".py"} and path.is_file()  # no link to nothing
        ]
        files = {str(path.relative_to(folder)): path for path in found}
        modules = {
            ".".join(path.relative_to(folder).with_suffix("").parts).removesuffix(".__init__"): path
            for path in found
            if path.suffix == ".py"
        }
        imported = _imported(modules, [str(folder), *sys.path]).items()
        files.update((name, path) for name, path in imported if name not in modules)
    else:
        name = target.source.partition(":")[0]
        file = getattr(sys.modules.get(name), "__file__", None)
        if file is None:
            raise TargetError(text, "its module has no file; expected one that can be hashed.")
        path = Path(file).resolve()
        is_file = names_file(place)
        files = _imported({name: path}, [str(path.parent), *sys.path] if is_file else sys.path)
        if is_file and "." not in name:  # it may have a number, as others have its name, too
            files[path.stem] = files.pop(name)
    if len(files) > MAX_FILES:
        raise TargetError(
            text,
            f"got more than {MAX_FILES} files; expected fewer, as all are in its hash. Try the "
            "mission in a folder of its own.",
        )
    for path in files.values():
        if path.suffix == ".py" and _has_other_bytecode(path):
            cached = cache_from_source(str(path))
            with contextlib.suppress(OSError):
                Path(cached).unlink()
            raise TargetError(
                text,
                f"{str(path)!r} has the bytecode of another file of the same second and length; "
                f"expected its own. Try again, without {cached!r}.",
            )
    hashes = {name: _hash(path) for name, path in sorted(files.items())}
    name = Path(place).name if is_data(place) else target.source.partition(":")[2]
    return {"target": text, "name": name, "hash": _whole({**hashes, ":": name}), "files": hashes}


def library_facts() -> dict[str, Any]:
    """Return what identifies this library: its `version`, the `hash` of its files, and `python`."""
    hashes = {}
    for name in LIBRARY:
        folder = Path(str(sys.modules[name].__file__)).parent
        for path in sorted(folder.rglob("*.py")):
            hashes[f"{name}/{path.relative_to(folder).as_posix()}"] = _hash(path)
    return {
        "version": version("smachpy"),
        "hash": _whole(hashes),
        "python": platform.python_version(),
    }


def find_seal(places: Sequence[str], target: Target, text: str) -> Seal:
    """Return what evidence there is of a mission.

    One good file is enough, whatever others there are.

    Args:
        places: Files of `smachpy certify`, and folders with them.
        target: The mission, just loaded.
        text: As the user named it.

    Raises:
        TargetError: as `mission_facts`.
    """
    mission, library = mission_facts(target, text)["hash"], library_facts()["hash"]
    near = ["none of this mission", "", "", ""]  # the later, the nearer
    valid, taken = "", None
    for path in _files(places):
        name = printable(str(path))
        try:
            found = read_evidence(path)
        except EvidenceError as error:
            near[1] = near[1] or f"a file that cannot be read: {error}"
            continue
        if found["mission"]["hash"] != mission:
            continue
        taken = (taken or frozenset()).union(*found["taken"].values())
        if found["library"]["hash"] != library:
            near[2] = near[2] or f"{name}, of another version of smachpy"
        elif not found["ok"]:
            near[3] = near[3] or f"{name}, which has found problems"
        else:
            valid = valid or f"valid, {name}"
    text = valid or next(filter(None, reversed(near)))
    return Seal(bool(valid), f"{text}; hash {mission}", taken)


def check_evidence(places: Sequence[str], target: Target, text: str) -> Seal:
    """Return the seal of a mission; refuse a mission without good evidence.

    Args:
        places: As for `find_seal`.
        target: The same.
        text: The same.

    Raises:
        EvidenceError: there is none for these files and this library.
    """
    seal = find_seal(places, target, text)
    if not seal.is_valid:
        raise EvidenceError(
            f"mission {target.name!r}: evidence: got none that is good ({seal.text}); expected "
            f"one of these files. Try 'smachpy certify {text} -o FILE'."
        )
    return seal


def read_evidence(path: Path) -> dict[str, Any]:
    """Return the content of a file.

    Raises:
        EvidenceError: it has none.
    """
    try:
        data = load_json(read_limited(path, LARGEST).decode("utf-8"), longest=LARGEST)
        found: dict[str, Any] = checked(_Evidence, data, known_only=True)
    except (OSError, ValueError) as error:
        why = (error.strerror if isinstance(error, OSError) else None) or error
        raise EvidenceError(
            f"evidence {str(path)!r}: {why}; expected a file of 'smachpy certify'."
        ) from error
    return found


def _files(places: Sequence[str]) -> Iterator[Path]:
    for place in map(Path, places):
        if place.is_dir():
            yield from sorted(path for path in place.glob("*.json") if path.is_file())
        else:
            yield place


def _hash(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _has_other_bytecode(path: Path) -> bool:
    """Return whether Python has cached bytecode for a file, and that is of other code.

    It knows the file by its time [s] and length only.
    """
    try:
        cached = Path(cache_from_source(str(path))).read_bytes()
        header, stat = struct.unpack_from("<4sIII", cached), path.stat()
        is_known = header[1] or header[2:] == (
            int(stat.st_mtime) & 0xFFFFFFFF,
            stat.st_size & 0xFFFFFFFF,
        )
        if header[0] != MAGIC_NUMBER or not is_known:
            return False
        code = compile(path.read_bytes(), str(path), "exec", dont_inherit=True)
        return bool(marshal.loads(cached[_CODE:]) != code)  # noqa: S302  as Python does
    except (OSError, SyntaxError, ValueError, EOFError, TypeError, struct.error):
        return False  # there is none, or Python does not take it, or cannot import the file


def _whole(hashes: dict[str, str]) -> str:
    return hashlib.sha256(json.dumps(sorted(hashes.items())).encode()).hexdigest()[:16]


# -- the modules of a program ----------------------------------------------------------------------


def _imported(roots: dict[str, Path], path: Sequence[str]) -> dict[str, Path]:
    """Return modules, and those of the program that they import: name -> file.

    Args:
        roots: The modules, name -> file.
        path: Where others are looked up.
    """
    apart = [Path(p).resolve() for p in {*sysconfig.get_paths().values(), sys.base_prefix}]
    tops = {name.partition(".")[0] for name in roots}
    found = dict(roots)
    waiting = list(roots.items())
    while waiting and len(found) <= MAX_FILES:
        module, at = waiting.pop()
        for word in _names_in(module, at) if at.suffix == ".py" else ():  # else it is compiled
            for one, where in _found(word, path):
                first = one.partition(".")[0]
                is_apart = any(where.is_relative_to(place) for place in apart)
                is_own = first in tops or (first not in {*LIBRARY, "smachpy_viz"} and not is_apart)
                if one not in found and is_own:
                    found[one] = where
                    waiting.append((one, where))
    return found


def _names_in(module: str, file: Path) -> Iterator[str]:
    """Yield the names that the import statements of a file may mean, anywhere in it."""
    package = module if file.name == "__init__.py" else module.rpartition(".")[0]
    try:
        tree = ast.parse(file.read_bytes())
    except (SyntaxError, ValueError):  # nobody can import it
        return
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: len(package.split(".")) + 1 - node.level]
            base = ".".join(
                [*(above if node.level else []), *([node.module] if node.module else [])]
            )
            yield from (f"{base}.{alias.name}".strip(".") for alias in node.names)


def _found(name: str, path: Sequence[str]) -> Iterator[tuple[str, Path]]:
    """Yield the files of a module and of the packages in which it is; nothing is imported."""
    so_far: list[str] = []
    where: Any = path
    for part in name.split("."):
        so_far.append(part)
        whole = ".".join(so_far)
        spec = None if where is None else PathFinder.find_spec(whole, where)
        origin = None if spec is None else spec.origin
        if origin is None and where is path:  # of an editable installation
            origin = getattr(sys.modules.get(whole), "__file__", None)
        if origin is not None and Path(origin).is_file():
            yield whole, Path(origin).resolve()
        known = getattr(sys.modules.get(whole), "__path__", None)
        where = known if spec is None else spec.submodule_search_locations
