"""`smachpy completion`: completes commands and options in a shell."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import argparse


def register(subparsers: Any) -> None:
    """Add `smachpy completion`."""
    parser = subparsers.add_parser(
        "completion",
        help="print what completes commands in bash or zsh",
        description="Print a script for a shell. For bash: smachpy completion bash "
        "> ~/.local/share/bash-completion/completions/smachpy; for zsh: into a folder of $fpath, "
        "as _smachpy.",
    )
    parser.add_argument("shell", choices=("bash", "zsh"))
    parser.set_defaults(run=_completion)


def _completion(args: argparse.Namespace) -> int:
    import shtab

    from smachpy.command import full_parser

    print(shtab.complete(full_parser(), args.shell))
    return 0
