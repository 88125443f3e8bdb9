"""The import hook that finds the modules which programs for ROS 1 import.

In this order: ROS's own names (`rospy`, `smach`, `tf`, ...) in `smachpy.ros1.names`; messages of
the bundled packages, of the project and of SMACHPY_INTERFACE_PATH; modules of the project,
converted from Python 2 if necessary. All other modules are left to Python's own finders. If those
fail and a file of the project imports the module, it gets a stand-in, if that was chosen, or a
helpful error.
"""

from __future__ import annotations

import linecache
import re
import sys
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from importlib.util import find_spec, spec_from_file_location
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.interfaces import add_definition, add_path
from smachpy.compat import MODULES as SMACH_MODULES
from smachpy.ros1 import python2
from smachpy.ros1.border import Border
from smachpy.ros1.generated import config_file, config_module, define_generated
from smachpy.ros1.imports import OWN, lies_in, settle_imports
from smachpy.ros1.project import KINDS, is_package
from smachpy.ros1.session import session
from smachpy.ros1.stubs import OldSection, StubModule, StubSection

if TYPE_CHECKING:
    import ast
    from collections.abc import Iterable, Sequence
    from types import CodeType, FrameType, ModuleType

    from smachpy.ros1.project import Project

NAMES: Final = "smachpy.ros1.names"
INTERFACES: Final = "actionlib_core.interfaces"
OLD_NAMES: Final = frozenset(
    {
        *("PyKDL", "actionlib", "dynamic_reconfigure", "rospkg", "rosparam", "rospy", "rostest"),
        *("roslib", "rosunit", "smach", "smach_ros", "tf", "tf2_geometry_msgs", "tf2_ros"),
        *("genpy", "message_filters", "rosgraph", "rosnode", "rosservice", "rostopic"),
        *("tf_conversions", "pnp_cmd_ros"),
    }
)
"""The packages of ROS 1 that `smachpy.ros1.names` provides."""

ALIASES: Final = {
    name.replace("smachpy.", f"{old}.", 1): home
    for old in ("smach", "smach_ros")
    for name, home in SMACH_MODULES.items()
} | {
    "actionlib.exceptions": "actionlib_core.exceptions",
    "actionlib.goal_id_generator": "actionlib_core.action.goal_id_generator",
    "actionlib.handle_tracker_deleter": "actionlib_core.action.compat",
    "actionlib.server_goal_handle": "actionlib_core.action.server",
    "actionlib.status_tracker": "actionlib_core.action.compat",
    "genpy.message": "smachpy.ros1.names.genpy",
    "genpy.rostime": "smachpy.ros1.names.rospy.rostime",
    "roslib.rostime": "smachpy.ros1.names.rospy.rostime",
    **dict.fromkeys(
        ("rosgraph.masterapi", "rosgraph.names", "rosgraph.rosenv"), "smachpy.ros1.names.rosgraph"
    ),
    "sensor_msgs.point_cloud2": "smachpy.ros1.names.point_cloud2",
    "smach.exceptions": "smachpy.exceptions",
    "smach.log": "smachpy.base.log",
    "smach.util": "smachpy.machines.util",
    "smach_ros.introspection": "smachpy.network.server",
    "smach_ros.util": "smachpy.machines.util",
    "tf2_geometry_msgs.tf2_geometry_msgs": "smachpy.ros1.names.tf2_geometry_msgs",
    **dict.fromkeys(
        [f"rospkg.{part}" for part in ("common", "manifest", "rospack", "stack")],
        "smachpy.ros1.names.rospkg",
    ),
    **dict.fromkeys(("tf.broadcaster", "tf.listener"), "smachpy.ros1.names.tf"),
    **dict.fromkeys(
        [
            f"tf2_ros.{part}"
            for part in (
                *("buffer", "buffer_client", "buffer_interface", "transform_broadcaster"),
                *("static_transform_broadcaster", "transform_listener"),
            )
        ],
        "smachpy.ros1.names.tf2_ros",
    ),
}
"""Module names of ROS 1 that have another name here -> the module here."""

_SECTIONS: Final = ("msg", "srv")
_NEVER_STUBBED: Final = frozenset({"__main__", "sitecustomize", "usercustomize"})


class MissingPackageError(ModuleNotFoundError):
    """A program imports a module that neither this package nor its project has.

    Attributes:
        name: The module.
        file: The file that imports it.
        line: The line of the import.
    """

    def __init__(self, name: str, file: str, line: int) -> None:
        self.file, self.line = file, line
        package = name.partition(".")[0]
        if re.search(rf"\b{package}\.(msg|srv)\b", f"{name} {linecache.getline(file, line)}"):
            text = (
                f"message package {package!r} is missing: got no definition of it; expected one in "
                "the script's folder, in a package beside it (msg, srv, action) or in a folder of "
                f"SMACHPY_INTERFACE_PATH. Try setting SMACHPY_INTERFACE_PATH=FOLDER, where "
                f"FOLDER/{package}/msg is,"
            )
        else:
            text = (
                f"module {name!r} is missing; expected it in the script's folder, in a package "
                f"beside it (src, scripts) or installed. Try installing it,"
            )
        super().__init__(f"{file}:{line}: {text} or --stub-missing for a stand-in.", name=name)


class _Alias(Loader):
    """Imports a module under another name."""

    def __init__(self, home: str, border: Border) -> None:
        self._home = home
        self._border = border

    def create_module(self, spec: ModuleSpec) -> None:
        """Leave it to Python."""

    def exec_module(self, module: ModuleType) -> None:
        """Replace the new empty module by the real one."""
        # One module object under both names, so that `isinstance` and module state agree.
        name = module.__name__
        sys.modules[name] = real = import_module(self._home)
        if name in OLD_NAMES:  # in ROS 1 a package has imported these submodules of its own
            for old, home in ALIASES.items():
                package, _, part = old.partition(".")
                if package == name and not hasattr(real, part):
                    setattr(real, part, import_module(home))
        self._border.add(real)


class _Stub(Loader):
    """Makes a stand-in, or a section (`msg`, `srv`) of a package of interfaces."""

    def __init__(self, *, known: bool = False, complete: bool = False) -> None:
        self._known = known  # the package exists, but may lack some interfaces
        self._complete = complete  # a missing interface is an error, and gets no stand-in

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Make a section of interfaces or a module."""
        _, _, section = spec.name.partition(".")
        if section not in _SECTIONS:
            return StubModule(spec.name)
        known = import_module(f"{INTERFACES}.{spec.name}") if self._known else None
        return (OldSection if self._complete else StubSection)(spec.name, known)

    def exec_module(self, module: ModuleType) -> None:
        """Nothing to run."""


class _Generated(Loader):
    """Makes `pkg.msg._Name`, a module of ROS 1's generator that some programs import directly."""

    def create_module(self, spec: ModuleSpec) -> None:
        """Leave it to Python."""

    def exec_module(self, module: ModuleType) -> None:
        """Add the class, and for a service those of request and response."""
        section, _, name = module.__name__.rpartition("._")
        home = import_module(section)
        setattr(module, name, getattr(home, name))
        if section.endswith(".srv"):
            for end in ("Request", "Response"):
                setattr(module, name + end, getattr(home, name + end))


class _Config(Loader):
    """Makes `pkg.cfg.NameConfig` from its `.cfg` file; without a file, the package around it."""

    def __init__(self, file: Path | None) -> None:
        self._file = file

    def create_module(self, spec: ModuleSpec) -> None:
        """Leave it to Python."""

    def exec_module(self, module: ModuleType) -> None:
        """Run the file."""
        if self._file is not None:
            vars(module).update(config_module(self._file))


class OldSourceLoader(SourceFileLoader):
    """Loads a module of the project, converted from Python 2 if necessary; writes no bytecode."""

    def __init__(self, finder: OldNames, fullname: str, path: str) -> None:
        super().__init__(fullname, path)
        self._finder = finder

    def get_code(self, fullname: str) -> CodeType:
        """Compile the source."""
        path = self.get_filename(fullname)
        in_package = "." in fullname or path.endswith("__init__.py")
        return self._finder.to_code(self.get_data(path), path, in_package=in_package)


class OldNames(MetaPathFinder):
    """The finder of the import hook.

    Args:
        project: The surroundings of the program.
        stub_missing: Whether missing modules get stand-ins.
    """

    def __init__(self, project: Project, *, stub_missing: bool = False) -> None:
        self.project = project
        self._stub_missing = stub_missing
        self._known: set[str] = set()  # packages of the project whose interfaces are registered
        self._busy: set[str] = set()  # names that are looked up in the other finders just now
        self._border = Border(stand_ins=stub_missing)

    def open(self) -> None:
        """Begin; modules of ROS's names that are imported already are changed as well."""
        self._border.open()
        for name, module in sys.modules.copy().items():
            if self._home_of(name) is not None:
                self._border.add(module)

    def close(self) -> None:
        """Give this package's classes back as they are."""
        self._border.close()

    def to_code(self, source: bytes, path: str, *, in_package: bool = False) -> CodeType:
        """Compile a file of the project.

        Args:
            source: Its content.
            path: The file.
            in_package: It belongs to a package.

        Raises:
            SyntaxError, MissingExtraError: as `python2.to_code`.
        """
        # In Python 2 a module of the same package came first, in Python 3 it is found last.
        old = in_package and python2.is_python2(source, path)

        def is_relative(name: str) -> bool:
            if not in_package or self.claims(name) or not lies_in(Path(path).parent, name):
                return False
            return old or not (self._in_project(name, None) or self._is_elsewhere(name))

        def settle(tree: ast.Module) -> None:
            settle_imports(tree, is_relative=is_relative, is_own=self._is_hidden)

        return python2.to_code(source, path, settle)

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Find a module; None leaves it to the finders after this one."""
        del target
        # 1. Names of ROS 1 that are provided here.
        home = self._home_of(fullname)
        if home is not None:
            return self._alias(fullname, home)
        top, _, below = fullname.partition(".")
        if (
            top in {"smachpy", "actionlib_core", "smachpy_viz", "smachpy_missions"}
            or fullname in self._busy
        ):
            return None
        # 2. Interfaces: the project's definitions have to be registered before they are looked up.
        if below.partition("._")[0] in _SECTIONS and "._" in below:
            return ModuleSpec(fullname, _Generated())
        if below and isinstance(sys.modules.get(top), StubModule):
            return self._missing(fullname, path)
        return self._of_project(fullname, path)

    def _of_project(self, fullname: str, path: Sequence[str] | None) -> ModuleSpec | None:
        if path is None and self._is_hidden(fullname):
            # The script's own module of this name has another one; see `settle_imports`.
            return PathFinder.find_spec(fullname, self._other_places())
        top, _, below = fullname.partition(".")
        self._register_interfaces(top)
        has_interfaces = find_spec(f"{INTERFACES}.{top}") is not None
        # 3. Modules of the project. A package may have both modules and interfaces; its `msg` and
        #    `srv` always are the interfaces here, not generated modules in the project.
        found = None
        if not (has_interfaces and below in _SECTIONS):
            found = self._in_project(fullname, path)
        if found is None and has_interfaces and below in {"", *_SECTIONS}:
            if below:
                loader = _Stub(known=True, complete=not self._stub_missing)
                return ModuleSpec(fullname, loader, is_package=True)
            found = self._alias(fullname, f"{INTERFACES}.{fullname}")
        return found or self._config(fullname) or self._missing(fullname, path)

    def _config(self, fullname: str) -> ModuleSpec | None:
        """Find `pkg.cfg.NameConfig` by its file `cfg/Name.cfg`; then also `pkg` and `pkg.cfg`."""
        package, _, below = fullname.partition(".")
        section, _, name = below.partition(".")
        folder = self.project.packages().get(package)
        if folder is None or section not in {"", "cfg"}:
            return None
        file = config_file(folder, name)
        if file is None:
            return None
        return ModuleSpec(fullname, _Config(file if name else None), is_package=not name)

    def claims(self, name: str) -> bool:
        """Return whether a module name belongs to ROS, so that other modules must not have it."""
        top = name.partition(".")[0]
        return top in OLD_NAMES or find_spec(f"{INTERFACES}.{top}") is not None

    def made(self, name: str, module: ModuleType) -> bool:
        """Return whether a module was found by this finder."""
        if self.claims(name) or isinstance(module, (StubModule, OldSection)):
            return True
        return self._is_of_project(module)

    def _is_of_project(self, module: Any) -> bool:
        """Return whether a module belongs to the project; false for None."""
        if isinstance(getattr(module, "__loader__", None), (OldSourceLoader, _Config)):
            return True
        places = getattr(module, "__path__", ()) if not getattr(module, "__file__", None) else ()
        return any(self.project.holds(place) for place in places)

    def _home_of(self, fullname: str) -> str | None:
        # `from sensor_msgs import point_cloud2` asks for a submodule of the module's real name.
        old = fullname.removeprefix(f"{INTERFACES}.").removeprefix(f"{NAMES}.")
        alias = ALIASES.get(old)
        if alias is not None or fullname.partition(".")[0] not in OLD_NAMES:
            return alias
        home = f"{NAMES}.{fullname}"
        try:
            return home if find_spec(home) is not None else None
        except ModuleNotFoundError:
            return None

    def _register_interfaces(self, package: str) -> None:
        """Register the definitions of a package of the project, once."""
        if package in self._known:
            return
        self._known.add(package)
        folder = self.project.packages().get(package)
        if folder is None:
            return
        found = self.project.interfaces_of(package)
        if found and folder.name == package:
            add_path(folder)
        else:
            for kind in KINDS:
                for file in found.get(kind, []):
                    text = file.read_text(encoding="utf-8-sig")
                    add_definition(kind, f"{package}/{file.stem}", text, str(file))
        define_generated(folder, package, [file for files in found.values() for file in files])

    def _is_hidden(self, name: str) -> bool:
        """Return whether a module beside the script would hide one of Python or an installed one.

        In Python it does, but this package imports some of its own modules late.
        """
        if not lies_in(self.project.folder, name) or self.claims(name):
            return False
        return name in sys.stdlib_module_names or bool(
            PathFinder.find_spec(name, self._other_places())
        )

    def _other_places(self) -> list[str]:
        return [place for place in sys.path if not self.project.holds(place or ".")]

    def _in_project(self, fullname: str, path: Sequence[str] | None) -> ModuleSpec | None:
        name = fullname.rpartition(".")[2]
        if path is not None:
            places = [Path(place) for place in path if self.project.holds(place)]
            return _module(self, fullname, name, places) or self._namespace(fullname, places, path)
        if name.startswith(OWN):
            return _module(self, fullname, name.removeprefix(OWN), [self.project.folder])
        added = [Path(place) for place in sys.path if place and self.project.holds(place)]
        places = [*self.project.source_roots(), *_folder_of_importer(self.project), *added]
        found = _module(self, fullname, name, places) or self._namespace(fullname, places, path)
        if found is None and not self._is_elsewhere(fullname):
            last = list(self.project.other_roots())
            found = _module(self, fullname, name, last) or self._namespace(fullname, last, path)
        return found

    def _namespace(
        self, fullname: str, places: list[Path], path: Sequence[str] | None
    ) -> ModuleSpec | None:
        """Find a package without `__init__.py`: folders with modules, if no other finder has it."""
        folders = [place / fullname.rpartition(".")[2] for place in places]
        found = [
            str(folder)
            for folder in folders
            if not is_package(folder) and next(folder.glob("*.py"), None) is not None
        ]
        if not found or (path is None and self._is_elsewhere(fullname)):
            return None
        spec = ModuleSpec(fullname, None, is_package=True)
        spec.submodule_search_locations = list(dict.fromkeys(found))
        return spec

    def _missing(self, fullname: str, path: Sequence[str] | None) -> ModuleSpec | None:
        """Handle a module that no finder has: return a stand-in, or raise a helpful error.

        None if another finder has it, or if it is not the project that imports it: libraries try
        imports and handle the error themselves.
        """
        importer = _importer()
        if importer is None or not self.project.holds(importer[0]) or fullname in _NEVER_STUBBED:
            return None
        if path is not None:
            above = fullname.rpartition(".")[0]
            parent = sys.modules.get(above)
            lacks = self._stub_missing and self._is_of_project(parent)
            if not (lacks or isinstance(parent, StubModule) or self.claims(above)):
                return None  # its package was found, and Python's own error is clear
        elif self._is_elsewhere(fullname):
            return None
        if self._stub_missing:
            session().stand_in(f"module {fullname}")
            return ModuleSpec(fullname, _Stub(), is_package=True)
        file, line = importer
        raise MissingPackageError(fullname, file, line)

    def _alias(self, fullname: str, home: str) -> ModuleSpec:
        return ModuleSpec(fullname, _Alias(home, self._border), is_package=True)

    def _is_elsewhere(self, fullname: str) -> bool:
        """Return whether the finders after this one have a module."""
        self._busy.add(fullname)  # `find_spec` asks this finder too, which then declines
        try:
            return find_spec(fullname) is not None
        except (ImportError, ValueError):
            return False
        finally:
            self._busy.discard(fullname)


def _module(
    finder: OldNames, fullname: str, name: str, places: Iterable[Path]
) -> ModuleSpec | None:
    """Find a module or package in the first of some folders that has it."""
    for place in places:
        for file in (place / name / "__init__.py", place / f"{name}.py"):
            if file.is_file():
                folders = [str(file.parent)] if file.name == "__init__.py" else None
                loader = OldSourceLoader(finder, fullname, str(file))
                return spec_from_file_location(
                    fullname, file, loader=loader, submodule_search_locations=folders
                )
    return None


def _importer() -> tuple[str, int] | None:
    """Return file and line of the import statement."""
    frame: FrameType | None = sys._getframe(1)
    while frame is not None:
        file = frame.f_code.co_filename
        if file != __file__ and "importlib" not in file:
            return file, frame.f_lineno
        frame = frame.f_back
    return None


def _folder_of_importer(project: Project) -> list[Path]:
    """Return the folder of the importing module: in Python 2, `import x` looks there first."""
    importer = _importer()
    if importer is None or not project.holds(importer[0]):
        return []
    return [Path(importer[0]).resolve().parent]
