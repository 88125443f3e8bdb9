"""The routes for commands to machines, answers to questions, and goals to actions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from starlette.concurrency import run_in_threadpool
from starlette.routing import Route

from smachpy_viz.live.actions import GoalRefusedError
from smachpy_viz.live.answers import Json, RequestError, command_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from starlette.requests import Request
    from starlette.responses import Response

    from smachpy_viz.live.actions import Actions
    from smachpy_viz.live.security import Access


class CommandRoutes:
    """Answers the requests for commands.

    Args:
        send: Sends a command to a machine and returns the answer; blocks. None: no commands.
        actions: The actions on the network; None for none.
        access: Who may command.
        mission_of: Returns the mission that has sent a goal, as text; "" for none.
    """

    def __init__(
        self,
        send: Callable[[str, dict[str, Any]], dict[str, Any]] | None,
        actions: Actions | None,
        access: Access,
        mission_of: Callable[[str], str],
    ) -> None:
        self._mission_of = mission_of
        self._send = send
        self._actions = actions
        self._access = access
        self.routes = [
            Route("/api/control", self._control, methods=["POST"]),
            Route("/api/action", self._form, methods=["GET"]),
            Route("/api/action", self._command_action, methods=["POST"]),
            Route("/api/goals", self._goals),
        ]

    async def _control(self, request: Request) -> Response:
        # Refused before the body is read: it may be large, and its sender is not trusted.
        self._access.check_command(request)
        if self._send is None:
            raise RequestError("this viewer sends no commands to machines.", 403)
        name = request.query_params.get("machine", "")
        command = await command_of(request)
        client = request.client.host if request.client else "?"
        command = {"by": f"page at {client}", **command}  # the page may name its user
        answer = await run_in_threadpool(self._send, name, command)
        if not answer["ok"]:
            raise RequestError(str(answer["text"]), 409)
        return Json(answer)

    async def _form(self, request: Request) -> Response:
        name = request.query_params.get("name", "")
        return Json(await run_in_threadpool(self._there().definition, name))

    async def _goals(self, request: Request) -> Response:
        name = request.query_params.get("name", "")
        goals = await run_in_threadpool(self._there().server_goals, name)
        return Json([{**goal, "mission": self._mission_of(goal["id"])} for goal in goals])

    async def _command_action(self, request: Request) -> Response:
        self._access.check_command(request)
        command = await command_of(request)
        answer = await run_in_threadpool(_do, self._there(), command)
        return Json({"ok": True, **answer})

    def _there(self) -> Actions:
        if self._actions is None:
            raise RequestError("this viewer shows no actions.", 404)
        return self._actions


def _do(actions: Actions, command: dict[str, Any]) -> dict[str, Any]:
    """Carry out a command about an action."""
    match command:
        case {"command": "check", "name": str(name), "yaml": str(text)}:
            return actions.check(name, text)
        case {"command": "send", "name": str(name), "yaml": str(text)}:
            return {"goal": actions.send(name, text)}
        case {"command": "cancel", "name": str(name), "goal": str(goal)}:
            actions.cancel_any(name, goal)
            return {"text": ""}
        case {"command": "cancel", "goal": str(goal)}:
            actions.cancel(goal)
            return {"text": ""}
    raise GoalRefusedError(
        f"command: got {sorted(command)}; expected `check` or `send` with name and yaml, "
        "or `cancel` with goal, and with name for the goal of another client."
    )
