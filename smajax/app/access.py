"""Who may use the server: whoever has its token, by an address of the loopback, from a page of its own."""

from __future__ import annotations

import secrets
from urllib.parse import urlsplit

from starlette.datastructures import URL
from starlette.requests import Request
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Receive, Scope, Send

LOOPBACK = ("127.0.0.1", "localhost", "[::1]")
HEADERS = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "same-origin",  # without a referrer a form would have no origin either
    "X-Content-Type-Options": "nosniff",
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; "
    "connect-src 'self'; form-action 'self'; base-uri 'none'; frame-ancestors 'none'",
}
NO_TOKEN = (
    "This page needs the address that `smajax app` printed, with its token. Copy that address into the browser; each start of the "
    "server has a token of its own."
)


class Access:
    """ASGI middleware. A request needs the token, once in the address and then as a cookie.

    Other hosts are refused, so that no name that is made to lead here (DNS rebinding) reaches it, and so are forms of other pages.
    """

    def __init__(self, app: ASGIApp, token: str) -> None:
        self.app, self.token = app, token

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        request = Request(scope, receive)
        answer = self._refused(request)
        if answer is not None:
            await answer(scope, receive, send)
            return
        await self.app(scope, receive, send)

    def _refused(self, request: Request) -> Response | None:
        """The answer to a request that may not pass, or that brings the token; None for one that may."""
        host = request.headers.get("host", "")
        if host.rpartition(":")[0] not in LOOPBACK and host not in LOOPBACK:
            return PlainTextResponse("this server answers on the loopback only", 403)
        origin = request.headers.get("origin")
        foreign = origin is not None and urlsplit(origin).netloc != host
        if request.method not in ("GET", "HEAD") and foreign:
            return PlainTextResponse("a form of another page", 403)
        cookie = f"smajax_{host.rpartition(':')[2]}"  # cookies do not distinguish ports
        given = request.query_params.get("token")
        if given is not None and self._matches(given):
            clean = URL(str(request.url)).remove_query_params("token")
            answer = RedirectResponse(f"{clean.path}?{clean.query}" if clean.query else clean.path, 303)
            answer.set_cookie(cookie, self.token, httponly=True, samesite="lax", path="/")
            return answer
        if not self._matches(request.cookies.get(cookie, "")):
            return PlainTextResponse(NO_TOKEN, 403)
        return None

    def _matches(self, given: str) -> bool:
        return secrets.compare_digest(given.encode(), self.token.encode())
