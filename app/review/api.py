"""The review's data by HTTP: the list, curves, computations, notes. Errors are said in words."""

import asyncio
from collections import OrderedDict
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import msgspec
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from app.errors import AppError
from app.recording.cache import load_cache
from app.recording.errors import RecordingError
from app.recording.listing import entry_of
from app.recording.numbering import FINISHED
from app.review.errors import ConflictError, MissingError, OutsideError, ReviewError
from app.review.folder import Listed, ReviewFolder
from app.review.gate import Gate
from app.review.glance import Glances
from app.review.jobs import Job, Jobs
from app.review.notes import read_notes, save_notes
from app.review.opening import present
from app.review.packing import MEDIA_TYPE
from app.review.signals import COLUMNS, Signals
from app.review.wishes import ShareWish, WhatIfWish

MAX_BODY_BYTES = 64 * 1024
MAX_OPEN = 2
"""Trials whose curves are kept in memory; two, so that memory stays flat whatever is opened."""

_ALL_METHODS = ("GET", "POST", "PUT", "DELETE")

Endpoint = Callable[[Request], Awaitable[Response]]
Opened = tuple[dict[str, Any], Signals]


class Api:
    """The endpoints, with the folder they serve."""

    def __init__(self, folder: ReviewFolder, gate: Gate, jobs: Jobs, glances: Glances) -> None:
        self._folder, self._gate, self._jobs, self._glances = folder, gate, jobs, glances
        self._open: OrderedDict[tuple[str, tuple[int, int]], Opened] = OrderedDict()
        self._scanning = asyncio.Lock()

    def routes(self) -> list[Route]:
        """Everything under /api/review."""
        trial = "/api/review/trial/{id:path}"
        get, act = self._reading, self._acting
        return [
            Route("/api/review/trials", get(self._trials)),
            Route(trial + "/signals", get(self._signals)),
            Route(trial + "/notes", get(self._notes)),
            Route(trial + "/notes", act(self._save_notes), methods=["PUT"]),
            Route(trial + "/what-if", act(self._what_if), methods=["POST"]),
            Route(trial + "/share", act(self._share), methods=["POST"]),
            Route("/api/review/jobs/{job}", get(self._job)),
            Route("/api/review/jobs/{job}", act(self._cancel), methods=["DELETE"]),
            Route("/api/review/{rest:path}", get(self._unknown), methods=list(_ALL_METHODS)),
        ]

    # who may, and how refusals are said

    def _reading(self, endpoint: Endpoint) -> Endpoint:
        return self._guarded(endpoint, self._gate.refusal)

    def _acting(self, endpoint: Endpoint) -> Endpoint:
        return self._guarded(endpoint, self._gate.refusal_to_act)

    def _guarded(self, endpoint: Endpoint, refusal: Callable[[Request], str]) -> Endpoint:
        async def guarded(request: Request) -> Response:
            complaint = refusal(request)
            if complaint:
                return _error(complaint, 403)
            try:
                return await endpoint(request)
            except OutsideError as error:
                return _error(str(error), 403)
            except MissingError as error:
                return _error(str(error), 404)
            except ConflictError as error:
                return _error(str(error), 409)
            except AppError as error:
                return _error(self._without_root(str(error)), 422)

        return guarded

    def _without_root(self, text: str) -> str:
        """An error about a file names it as the page knows it."""
        return text.replace(f"{self._folder.root}/", "")

    # the list

    async def _trials(self, request: Request) -> Response:
        async with self._scanning:  # two pages that poll look once each, not both at once
            listed = await asyncio.to_thread(self._folder.scan)
        self._glances.want([t for t in listed if not t.entry.problem and t.id.endswith(FINISHED)])
        trials = await asyncio.to_thread(lambda: [self._row(trial) for trial in listed])
        return JSONResponse({"folder": self._folder.root.name, "trials": trials})

    def _row(self, listed: Listed) -> dict[str, Any]:
        row: dict[str, Any] = msgspec.to_builtins(listed.entry)
        row |= {"path": None, "id": listed.id, "problem": self._without_root(listed.entry.problem)}
        try:
            notes = read_notes(listed.path)
            row |= {"flag": notes.flag, "note": notes.text}
        except ReviewError as error:
            row |= {"flag": False, "note": "", "note_problem": self._without_root(str(error))}
        glance = self._glances.get(listed)
        if glance is not None:
            row |= {"path": glance.path, "opposed": glance.opposed}
        return row

    # one trial

    async def _signals(self, request: Request) -> Response:
        trial_id = request.path_params["id"]
        first = _whole(request, "first", 0)
        last = _whole(request, "last", -1)
        path = self._folder.finished(trial_id)
        opened = await asyncio.to_thread(self._opened, path, trial_id)
        if opened is None:
            arguments = {"path": str(path), "trial_id": trial_id}
            return _waiting(self._jobs.start("app.review.opening:open_job", arguments))
        meta, signals = opened
        body = await asyncio.to_thread(signals.pack, meta, first, last)
        return Response(body, media_type=MEDIA_TYPE)

    def _opened(self, path: Path, trial_id: str) -> Opened | None:
        """The curves of a trial whose cache is fresh; None where it has to be made.

        Raises:
            RecordingError: If the log cannot be used at all.
        """
        stat = path.stat()
        key = (trial_id, (stat.st_size, stat.st_mtime_ns))
        known = self._open.get(key)
        if known is None:
            entry = entry_of(path)
            if entry.problem:
                raise RecordingError(entry.problem)
            log = load_cache(path, COLUMNS)
            if log is None:
                return None
            known = present(log, trial_id)
        self._open[key] = known
        self._open.move_to_end(key)
        while len(self._open) > MAX_OPEN:
            self._open.popitem(last=False)
        return known

    async def _notes(self, request: Request) -> Response:
        path = self._folder.path_of(request.path_params["id"])
        notes = await asyncio.to_thread(read_notes, path)
        return JSONResponse(msgspec.to_builtins(notes))

    async def _save_notes(self, request: Request) -> Response:
        path = self._folder.path_of(request.path_params["id"])
        body = await _body(request)
        notes = await asyncio.to_thread(save_notes, path, body)
        return JSONResponse(msgspec.to_builtins(notes))

    # computations

    async def _what_if(self, request: Request) -> Response:
        path = self._folder.finished(request.path_params["id"])
        wish = WhatIfWish.parse(await _body(request))
        return _waiting(self._jobs.start(wish.entry, wish.arguments(path)))

    async def _share(self, request: Request) -> Response:
        path = self._folder.finished(request.path_params["id"])
        wish = ShareWish.parse(await _body(request))
        return _waiting(self._jobs.start("app.review.share:share_job", wish.arguments(path)))

    async def _job(self, request: Request) -> Response:
        job = self._jobs.find(request.path_params["job"])
        if not job.done.is_set():
            return _waiting(job)
        if job.result is None:
            return _error(self._without_root(job.error), 422)
        response = Response(job.result.content, media_type=job.result.media_type)
        if job.result.filename:
            name = job.result.filename.encode("ascii", "replace").decode().replace('"', "")
            response.headers["content-disposition"] = f'attachment; filename="{name}"'
        return response

    async def _cancel(self, request: Request) -> Response:
        self._jobs.cancel(request.path_params["job"])
        return JSONResponse({"cancelled": True})

    async def _unknown(self, request: Request) -> Response:
        return _error(f"there is nothing at {request.url.path}", 404)


def _waiting(job: Job) -> Response:
    """The job goes on; its page asks again at /api/review/jobs/<id>."""
    return JSONResponse({"job": job.id, "progress": round(job.progress, 3)}, 202)


def _error(text: str, status: int) -> Response:
    return JSONResponse({"error": text}, status)


def _whole(request: Request, name: str, default: int) -> int:
    text = request.query_params.get(name)
    if text is None:
        return default
    try:
        return int(text[:12])
    except ValueError:
        raise ReviewError(f"{name} is {text[:40]!r}; valid: a step's number") from None


async def _body(request: Request) -> bytes:
    length = request.headers.get("content-length", "")
    body = b""
    if not length.isdigit() or int(length) <= MAX_BODY_BYTES:
        async for part in request.stream():
            body += part
            if len(body) > MAX_BODY_BYTES:
                break
        else:
            return body
    raise ReviewError(f"the request is too long; valid: at most {MAX_BODY_BYTES} bytes")
