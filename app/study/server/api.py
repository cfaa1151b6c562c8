"""`GET` and `POST /api/study`: the state of the page's participant, and what the page asks for."""

import logging
from typing import Any

from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from app.study.errors import AnswerError, ProtocolError, StorageError
from app.study.events import ExtraAsked, Returned
from app.study.server import requests as ask
from app.study.server.cookies import (
    LEFT,
    arrival_of,
    forget,
    has_left,
    keep_arrival,
    keep_participant,
    keep_session,
    participant_of,
)
from app.study.server.host import Host
from app.study.server.view import page_state, visitor_state, withdrawn_state
from app.study.store import Person
from app.web.limits import KeyedBuckets
from app.web.security import check_origin

logger = logging.getLogger("hindsight.study")
CODES_PER_S, CODE_BURST = 0.2, 10
"""Guesses of codes, of everybody together: codes have to be rare among what can be typed."""


class Refused(Exception):
    """An answer other than 200.

    Attributes:
        status: HTTP status.
        items: Question → what is wrong.
    """

    def __init__(self, status: int, text: str, items: dict[str, str] | None = None) -> None:
        super().__init__(text)
        self.status, self.items = status, items or {}


class Api:
    """The endpoint, with the host it serves."""

    def __init__(self, host: Host) -> None:
        self._host = host
        self._codes = KeyedBuckets(CODES_PER_S, CODE_BURST)

    async def get(self, request: Request) -> Response:
        """The state of the page."""
        person = participant_of(request, self._host)
        return await self._answer(request, person)

    async def post(self, request: Request) -> Response:
        """Do what the page asks for, and answer with the state after it."""
        complaint = check_origin(request, self._host.config)
        if complaint:
            return JSONResponse({"error": complaint}, 403)
        if request.headers.get("content-type", "").partition(";")[0] != "application/json":
            return JSONResponse({"error": "content-type: valid is application/json"}, 415)
        body = await read_body(request)
        if body is None:
            return JSONResponse({"error": f"at most {ask.MAX_BODY_BYTES} bytes"}, 413)
        person = participant_of(request, self._host)
        try:
            wish = ask.parse_request(body)
            return await self._do(request, wish, person)
        except Refused as error:
            return await self._answer(request, person, error.status, str(error), error.items)
        except AnswerError as error:
            text = "Some answers are missing or out of range."
            return await self._answer(request, person, 422, text, error.items)
        except ProtocolError as error:
            who = person.id if person else "a visitor"
            logger.warning("%s: refused: %s", who, error)
            return await self._answer(request, person, 409, str(error))
        except StorageError as error:
            logger.error("%s: %s", person.id if person else "a visitor", error)
            text = "Your answer could not be saved just now. Please try again in a moment."
            return await self._answer(request, person, 503, text)

    async def _do(self, request: Request, wish: ask.PageRequest, person: Person | None) -> Response:
        host = self._host
        if isinstance(wish, ask.Consent):
            return await self._consent(request, wish, person)
        if isinstance(wish, ask.Code):
            return await self._code(request, wish)
        if isinstance(wish, ask.Erase):
            return await self._erase(wish)
        if person is None:
            if isinstance(wish, ask.Withdraw):
                return self._gone(request, [])
            raise Refused(403, "This browser does not take part; open the link you were given.")
        if isinstance(wish, ask.Withdraw):
            return self._gone(request, await host.withdraw(person))
        now = person.state.at
        if wish.at < now or not person.state.is_open:
            logger.info("%s: %s of step %d came again at %d", person.id, wish.do, wish.at, now)
            return await self._answer(request, person)
        if wish.at > now:
            raise ProtocolError(f"step {wish.at} is not due; this participant is at {now}")
        if isinstance(wish, ask.Answer) and wish.do == "draft":
            await host.draft(person, wish.page, wish.values)
        elif isinstance(wish, ask.Answer):
            await host.answer(person, wish.page, wish.values)
        elif isinstance(wish, ask.Continue):
            await host.go_on(person, wish.page)
        elif isinstance(wish, ask.Back):
            page = person.state.plan.steps[now - 1].page
            await host.happen(person.id, Returned(page=page))
        else:
            await host.happen(person.id, ExtraAsked(place=wish.place))
        if wish.do != "draft":
            host.session(person.id).tell(event="changed")
        return await self._answer(request, person)

    async def _consent(
        self, request: Request, wish: ask.Consent, person: Person | None
    ) -> Response:
        host, arrival = self._host, arrival_of(request, self._host)
        if person is not None:
            return await self._answer(request, person)
        if host.paused:
            raise Refused(409, "The study takes nobody new at the moment. Please come back later.")
        rule = host.store.study.arrival
        parameters = {k: v for k, v in arrival.get("parameters", {}).items() if isinstance(v, str)}
        if rule.require == "code" and arrival.get("code") not in rule.codes:
            raise Refused(403, "Please type the code you were given first.")
        if rule.require == "parameters" and not parameters.get(rule.person):
            raise Refused(403, "Please open the link you were given by the recruiting platform.")
        person, token = await host.consent(
            wish.request,
            parameters,
            code=str(arrival.get("code", "")),
            pilot=bool(arrival.get("pilot")),
            fast=host.store.test and bool(arrival.get("fast")),
        )
        response = await self._answer(request, person)
        keep_participant(request, response, host, f"{person.id}.{token}")
        forget(request, response, host, "arrival")
        return response

    async def _code(self, request: Request, wish: ask.Code) -> Response:
        host = self._host
        if not self._codes.take("code"):
            raise Refused(429, "Too many codes were tried. Please wait a minute.")
        code = wish.code.strip()
        if code not in host.store.study.arrival.codes:
            raise Refused(422, "This code is not known. Please look again.", {"code": "not known"})
        response = JSONResponse({"state": visitor_state(host, asked_code=True)})
        keep_arrival(request, response, host, {**arrival_of(request, host), "code": code})
        return response

    async def _erase(self, wish: ask.Erase) -> Response:
        host = self._host
        if not self._codes.take("erase"):
            raise Refused(429, "Too many codes were tried. Please wait a minute.")
        person = host.store.by_withdrawal_code(wish.code)
        if person is None:
            raise Refused(
                422, "This withdrawal code is not known, or its data are deleted.", {"code": "no"}
            )
        return JSONResponse({"erased": await host.withdraw(person)})

    def _gone(self, request: Request, erased: list[str]) -> Response:
        state = {**withdrawn_state(self._host), "erased": erased}
        response = JSONResponse({"state": state})
        keep_participant(request, response, self._host, LEFT)
        forget(request, response, self._host, "session", "arrival")
        return response

    async def _answer(
        self,
        request: Request,
        person: Person | None,
        status: int = 200,
        error: str = "",
        items: dict[str, str] | None = None,
    ) -> Response:
        """The state, with what went wrong."""
        host = self._host
        if person is None:
            if has_left(request, host):
                state = withdrawn_state(host)
            else:
                known = bool(arrival_of(request, host).get("code"))
                state = visitor_state(host, asked_code=known)
        elif person.state.status == "excluded":
            state = withdrawn_state(host, "excluded")
        else:
            state = page_state(host, person)
        if person is not None and person.state.status == "completed":
            state |= await self._completion(person)
        message: dict[str, Any] = {"state": state}
        if error:
            message |= {"error": error, "items": items or {}}
        response = JSONResponse(message, status)
        if person is not None and person.state.is_open:
            keep_session(request, response, host, person)
        return response

    async def _completion(self, person: Person) -> dict[str, Any]:
        """Code and redirect, once all is on the disk."""
        host = self._host
        try:
            withdrawal = await host.save(person)
        except StorageError as error:
            logger.error("%s: %s", person.id, error)
            return {"saving": True}
        completion = host.store.study.completion
        code = completion.code or host.own_code(person.id)
        return {"completion": code, "redirect": completion.redirect, "withdrawal": withdrawal}


async def read_body(request: Request) -> bytes | None:
    """The body; None where it is too long."""
    body = b""
    async for chunk in request.stream():
        body += chunk
        if len(body) > ask.MAX_BODY_BYTES:
            return None
    return body
