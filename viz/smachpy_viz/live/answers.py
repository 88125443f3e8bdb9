"""What the page's server answers: JSON, downloads, and errors in one form.

An error of any route is the JSON object `Failure`, with the HTTP status that fits.
"""

from __future__ import annotations

import contextlib
import json
from http import HTTPStatus
from typing import TYPE_CHECKING, Any, Final

from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect
from starlette.responses import JSONResponse, Response

from actionlib_core.inputs.json_text import JsonTextError, load_json
from smachpy.exceptions import SmachError
from smachpy_viz.live.actions import GoalRefusedError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from starlette.requests import Request

    from smachpy_viz.live.machines import Machine, Machines
    from smachpy_viz.live.wire import Failure

MAX_COMMAND_LENGTH: Final = 1_000_000
"""Longest body of a request [bytes]."""


class Json(JSONResponse):
    """JSON in ASCII: names may contain lone UTF-16 surrogates, which UTF-8 cannot encode."""

    def render(self, content: Any) -> bytes:
        """Return the content as JSON."""
        return json.dumps(content, separators=(",", ":")).encode("ascii")


class RequestError(SmachError):
    """A request is refused.

    Try: open the page with the address that `smachpy view` printed: it holds the token.

    Attributes:
        status: The HTTP status.
        wants_token: Whether the page should ask its user for the token.
    """

    def __init__(self, text: str, status: int = 400, *, wants_token: bool = False) -> None:
        self.status = status
        self.wants_token = wants_token
        super().__init__(text)


@contextlib.contextmanager
def failing_with(status: int) -> Iterator[None]:
    """Give the status to a `SmachError` that is raised in the block; otherwise it is 409."""
    try:
        yield
    except SmachError as error:
        raise RequestError(str(error), status) from error


def failure(text: str, status: int, **more: Any) -> Json:
    """Return the response for an error."""
    content: Failure = {"ok": False, "text": text, "wants_token": False, "problems": [], **more}  # type: ignore[typeddict-item]  # `more` has fields of it
    return Json(content, status)


async def on_smach_error(_request: Request, error: Exception) -> Response:
    """Return the response for an error of smachpy."""
    if isinstance(error, RequestError):
        return failure(str(error), error.status, wants_token=error.wants_token)
    problems = error.problems if isinstance(error, GoalRefusedError) else []
    return failure(str(error), HTTPStatus.CONFLICT, problems=problems)


async def on_http_error(request: Request, error: Exception) -> Response:
    """Return the response for an unknown address or a wrong method."""
    assert isinstance(error, HTTPException)
    what = f"{request.method} {request.url.path}"
    response = failure(f"{what}: {error.detail.lower()}.", error.status_code)
    response.headers.update(error.headers or {})
    return response


async def on_any_error(request: Request, error: Exception) -> Response:
    """Return the response for a mistake in the viewer; uvicorn logs it with its traceback."""
    text = f"{request.url.path}: the viewer has a mistake: {type(error).__name__}. See its output."
    return failure(text, HTTPStatus.INTERNAL_SERVER_ERROR)


def machine_of(request: Request, machines: Machines, parameter: str = "machine") -> Machine:
    """Return the machine that a request names, with its structure.

    Raises:
        RequestError: there is none.
    """
    name = request.query_params.get(parameter, "")
    machine = machines.get(name)
    if machine is None or machine.record is None:
        raise RequestError(f"{parameter}: got {name!r}; expected one of /api/machines.", 404)
    return machine


async def command_of(request: Request) -> dict[str, Any]:
    """Return the JSON object in the body of a request.

    Raises:
        RequestError: it is too long, cut off, or something else.
    """
    # Read in parts, so that a long body is refused before it fills the memory.
    body, data = b"", None
    with contextlib.suppress(ClientDisconnect, JsonTextError):
        async for chunk in request.stream():
            body += chunk
            if len(body) > MAX_COMMAND_LENGTH:
                break
        data = load_json(body, longest=MAX_COMMAND_LENGTH)
    if not isinstance(data, dict):
        text = f"command: got no JSON object of at most {MAX_COMMAND_LENGTH} bytes; expected one."
        raise RequestError(text)
    return data


def download(data: bytes, media: str, name: str) -> Response:
    """Return the response for a file that the browser saves under a name."""
    headers = {"content-disposition": f'attachment; filename="{name}"'}
    return Response(data, media_type=media, headers=headers)


def file_name(machine: Machine) -> str:
    """Return a name for files about a machine."""
    label = machine.record.label if machine.record else machine.name
    # ASCII letters and digits only: the name goes into a header, and labels are not trusted.
    return "".join(c if c.isalnum() and c.isascii() else "_" for c in label)[:60] or "machine"
