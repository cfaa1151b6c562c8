"""All that reaches a page: bodies of answers and frames of its lines, kept to be searched."""

import re

from playwright.sync_api import Error, Page, Request, WebSocket

METHODS = re.compile(rb"\b([Bb]lend|[Pp]olicy|[Yy]ielding)\b")
"""Methods; not BLEND, by which glTF calls every material that can be seen through."""


class Traffic:
    """Listens to one page and its frames."""

    def __init__(self, page: Page) -> None:
        self.texts: list[tuple[str, bytes]] = []
        """Address and content, as they came."""
        self._finished: list[Request] = []
        page.on("requestfinished", lambda request: self._finished.append(request))
        page.on("websocket", self._listen)

    def _listen(self, socket: WebSocket) -> None:
        def keep(frame: str | bytes) -> None:
            self.texts.append((socket.url, frame.encode() if isinstance(frame, str) else frame))

        socket.on("framereceived", keep)

    def collect(self, *_: object) -> None:
        """Read the bodies while the browser still has them."""
        finished, self._finished[:] = list(self._finished), []
        for answer in filter(None, (request.response() for request in finished)):
            head = f"{answer.url}\n{answer.headers}".encode()
            try:
                body = answer.body()
            except Error:
                continue  # a redirect, or a page that has gone, has no body
            # The viewer's own client is one file, the same for everybody and every method.
            if "/view/" not in answer.url:
                self.texts += [(answer.url, body)]
            self.texts += [(f"head of {answer.url}", strip_policy(head))]

    def naming_a_method(self) -> list[str]:
        """Where a method's name came along."""
        return [
            f"{url}: …{text[max(0, found.start() - 60) : found.end() + 60]!r}…"
            for url, text in self.texts
            if (found := METHODS.search(text))
        ]

    def count(self, part: str) -> int:
        """How many messages came from addresses with this in them."""
        return sum(part in url for url, _ in self.texts)


def strip_policy(head: bytes) -> bytes:
    """HTTP has headers whose names end in -policy."""
    return re.sub(rb"[\w-]+-policy", b"", head)
