"""The experimenter's desk: who is where, what came out, and what may be done about it.

Behind a password (scrypt, guesses bounded), a strict cookie and an Origin check; every action is
written to `private/<study>/audit.jsonl`. It names cells, not methods: whoever sits beside a
participant stays blind, too.
"""

import asyncio
import logging
import secrets
import shutil
import tempfile
import time
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from starlette.background import BackgroundTask
from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, JSONResponse, Response

from app.errors import AppError
from app.study.errors import ProtocolError, StudyError
from app.study.events import Excluded, Noted, Redone, Skipped
from app.study.export import export_store
from app.study.server.api import read_body
from app.study.server.desk_view import desk_state
from app.study.server.host import Host
from app.study.server.password import check_password, read_hash
from app.study.tables import write_tables
from app.web.limits import KeyedBuckets
from app.web.pages import STATIC
from app.web.security import check_origin, cookie_name, host_of, page_policy, set_cookie

STAYS_S = 12 * 3600
GUESSES_PER_S, GUESS_BURST = 1 / 30, 5
AUDIT = "audit.jsonl"
logger = logging.getLogger("hindsight.study")


class Wish(BaseModel):
    """What the experimenter wants done."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    do: Literal["redo", "skip", "fail", "note", "pause", "end", "link", "logout"]
    participant: Annotated[str, Field(max_length=20)] = ""
    index: Annotated[int, Field(ge=-1, le=100000)] = -1
    text: Annotated[str, Field(max_length=4000)] = ""
    on: bool = False


class Login(BaseModel):
    """The password."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    password: Annotated[str, Field(max_length=1000)]


class Desk:
    """The endpoints, with the host they serve."""

    def __init__(self, host: Host) -> None:
        self._host = host
        self._until: dict[str, float] = {}
        """Secret of a login → when it ends."""
        self._guesses = KeyedBuckets(GUESSES_PER_S, GUESS_BURST)

    # pages

    async def page(self, request: Request) -> Response:
        """The desk's page; it shows nothing before the password."""
        return _page(request, STATIC / "study" / "desk.html")

    async def watch(self, request: Request) -> Response:
        """A participant's robot, for looking only; it is as blind as the participant's page."""
        host = self._host
        person = host.store.people.get(request.path_params["id"])
        if not self._is_in(request) or person is None:
            return JSONResponse({"error": "no such participant, or not logged in"}, 403)
        session = host.session(person.id)
        response = _page(request, STATIC / "index.html", session.id)
        name = cookie_name(request, host.config, "watch")
        set_cookie(response, name, session.watch_key, host.config)
        self._audit("watch", participant=person.id)
        return response

    async def download(self, request: Request) -> Response:
        """The shareable copy as one archive, without comments."""
        if not self._is_in(request):
            return JSONResponse({"error": "not logged in"}, 403)
        self._audit("download")
        folder = Path(await asyncio.to_thread(tempfile.mkdtemp, prefix="hindsight-export-"))
        try:
            archive = await asyncio.to_thread(_archive, self._host, folder)
        except (AppError, OSError) as error:
            shutil.rmtree(folder, ignore_errors=True)
            return JSONResponse({"error": str(error)}, 503)
        clean = BackgroundTask(shutil.rmtree, folder, ignore_errors=True)
        return FileResponse(archive, filename=archive.name, background=clean)

    # data

    async def get(self, request: Request) -> Response:
        """What the desk shows."""
        if not self._is_in(request):
            known = bool(read_hash(self._host.store.sessions))
            return JSONResponse({"login": True, "password": known}, 401)
        return JSONResponse(await asyncio.to_thread(desk_state, self._host))

    async def post(self, request: Request) -> Response:
        """Log in, or do something."""
        complaint = check_origin(request, self._host.config)
        if complaint:
            return JSONResponse({"error": complaint}, 403)
        body = await read_body(request)
        if body is None:
            return JSONResponse({"error": "too long"}, 413)
        try:
            if not self._is_in(request):
                return await self._login(request, Login.model_validate_json(body).password)
            wish = Wish.model_validate_json(body)
        except ValidationError as error:
            first: Any = error.errors(include_url=False)[0]
            return JSONResponse({"error": f"{first['loc']}: {first['msg']}"}, 422)
        self._audit(wish.do, **wish.model_dump(exclude={"do", "text"}, exclude_defaults=True))
        if wish.do == "logout":
            self._until.pop(self._secret(request), None)
            return JSONResponse({"login": True, "password": True}, 401)
        try:
            more = await self._do(wish)
        except StudyError as error:
            return JSONResponse({"error": str(error)}, 409)
        return JSONResponse({**await asyncio.to_thread(desk_state, self._host), **more})

    async def _do(self, wish: Wish) -> dict[str, Any]:
        host = self._host
        if wish.do == "pause":
            host.paused = wish.on
            return {}
        person = host.store.people.get(wish.participant)
        if person is None:
            raise ProtocolError(f"there is no participant {wish.participant!r}")
        session = host.sessions.get(person.id)
        if wish.do == "note":
            number = person.state.notes + 1
            note = {"participant": person.id, "number": number, "text": wish.text}
            line = {**note, "wall_s": time.time()}
            await asyncio.to_thread(host.store.private.append, f"{person.id}.notes.jsonl", line)
            await host.happen(person.id, Noted(number=number))
            return {}
        if wish.do == "link":
            token = await asyncio.to_thread(host.store.renew_token, person.id)
            return {"link": f"/?resume={person.id}.{token}"}
        if person.state.running is not None and session is not None:
            await session.interrupt(f"the experimenter: {wish.do}")
        if wish.do in ("redo", "fail"):
            index = person.state.at if wish.index < 0 else wish.index
            await host.happen(person.id, Redone(index=index))
        elif wish.do == "skip":
            await host.happen(person.id, Skipped(index=person.state.at))
        else:
            await host.happen(person.id, Excluded(reason="ended by the experimenter"))
            await asyncio.to_thread(write_tables, host.store)
        if session is not None:
            session.tell(event="changed")
            session.end_worker()
        return {}

    # who is asking

    async def _login(self, request: Request, password: str) -> Response:
        if not self._guesses.take("all"):
            self._audit("login refused: too many guesses")
            return JSONResponse({"error": "Too many tries. Wait half a minute."}, 429)
        kept = read_hash(self._host.store.sessions)
        if not kept or not await asyncio.to_thread(check_password, password, kept):
            self._audit("login failed")
            return JSONResponse({"error": "This is not the password."}, 401)
        secret = secrets.token_urlsafe(32)
        now = time.time()
        self._until = {k: until for k, until in self._until.items() if until > now}
        self._until[secret] = now + STAYS_S
        self._audit("login")
        response = JSONResponse(await asyncio.to_thread(desk_state, self._host))
        name = cookie_name(request, self._host.config, "desk")
        set_cookie(response, name, secret, self._host.config)
        return response

    def _is_in(self, request: Request) -> bool:
        return self._until.get(self._secret(request), 0.0) > time.time()

    def _secret(self, request: Request) -> str:
        return request.cookies.get(cookie_name(request, self._host.config, "desk"), "")

    def _audit(self, action: str, **detail: Any) -> None:
        try:
            line = {"wall_s": time.time(), "action": action, **detail}
            self._host.store.private.append(AUDIT, line)
        except StudyError as error:
            logger.error("audit: %s %s: %s", action, detail, error)


def _page(request: Request, path: Path, session: str = "") -> Response:
    text = path.read_text(encoding="utf-8")
    meta = '<meta name="hindsight-session" content="">'
    text = text.replace(meta, meta.replace('""', f'"{session}"'), 1)
    return HTMLResponse(text, headers={"content-security-policy": page_policy(host_of(request))})


def _archive(host: Host, folder: Path) -> Path:
    name = f"{host.store.study.name}-{time.strftime('%Y-%m-%d', time.gmtime())}"
    export_store(host.store, folder / name, with_comments=False)
    made = shutil.make_archive(str(folder / name), "zip", folder, name)
    return Path(made)
