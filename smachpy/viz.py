"""Pictures and views of machines: the names of the package `smachpy_viz`.

Write `from smachpy import viz`, then for instance `viz.render(machine, "machine.svg")`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from smachpy_viz import *  # noqa: F403  what it lists in `__all__`
else:

    def __getattr__(name: str) -> Any:  # on first use, as some views need an extra
        import smachpy_viz

        return getattr(smachpy_viz, name)


def __dir__() -> list[str]:
    import smachpy_viz

    return sorted(smachpy_viz.__all__)
