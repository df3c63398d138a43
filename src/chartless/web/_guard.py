"""Which requests are answered at all, and with which instructions to the browser.

A page on this computer can be reached by every page that the browser shows. So nothing is done for
a request that another site has sent: its host must be ours (else a name of theirs could stand for
our address), requests that change something must come with our origin and a header that only
scripts of our own page can set, and no other site may show, embed or read an answer.
"""

import secrets
from urllib.parse import parse_qs, urlencode

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import cookie_parser
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

HEADER = "x-chartless"
"""Set by our own script. Another site would have to ask for leave first, and gets none."""
_SAFE = {"GET", "HEAD"}
_FOREIGN = {"cross-site", "same-site"}  # another port of this computer is the same site
_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; connect-src 'self'; media-src 'self' blob:; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_HEADERS = {
    "content-security-policy": _POLICY,
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
    "permissions-policy": "camera=(self), microphone=(), geolocation=()",
    "cache-control": "no-store",
}


class Guard:
    """Middleware that answers no request of another site.

    Parameters
    ----------
    app : ASGI application
    hosts : frozenset of str, or None
        What the header Host may be; None for any, which takes a token.
    token : str, optional
        Secret that the first request brings in its address, and a cookie afterwards.
    cookie : str
        Name of that cookie.
    """

    def __init__(
        self, app: ASGIApp, *, hosts: frozenset[str] | None, token: str | None, cookie: str
    ) -> None:
        self._app = app
        self._hosts = hosts
        self._token = token
        self._cookie = cookie

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or refuse it."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        if scope["type"] != "http":
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in _HEADERS.items():
                    headers.setdefault(name, value)
            await send(message)

        answer = self._refusal(scope) or self._admission(scope)
        await (answer or self._app)(scope, receive, send_with_headers)

    def _refusal(self, scope: Scope) -> Response | None:
        headers = Headers(scope=scope)
        host = headers.get("host", "")
        if self._hosts is not None and host not in self._hosts:
            return PlainTextResponse("This is not the address that was printed.", 421)
        site = headers.get("sec-fetch-site", "none")
        goes = headers.get("sec-fetch-mode") == "navigate" and scope["path"] == "/"
        origin = headers.get("origin")
        is_safe = scope["method"] in _SAFE
        if (
            (site in _FOREIGN and not (goes and is_safe))
            or (origin is not None and origin.partition("://")[2] != host)
            or (not is_safe and HEADER not in headers)
        ):
            return PlainTextResponse("Only the page itself may request this.", 403)
        return None

    def _admission(self, scope: Scope) -> Response | None:
        """Ask for the token; one in the address becomes a cookie."""
        if self._token is None:
            return None
        query = parse_qs(scope["query_string"].decode("latin-1"))
        given = query.pop("token", [""])[0]
        if scope["path"] == "/" and scope["method"] in _SAFE and self._is_token(given):
            rest = urlencode(query, doseq=True)
            answer = RedirectResponse(f"/?{rest}" if rest else "/", 303)
            answer.set_cookie(self._cookie, self._token, httponly=True, samesite="strict")
            return answer
        if self._is_token(cookie_of(scope, self._cookie)):
            return None
        text = "Open the address with the token that chartless serve has printed."
        return PlainTextResponse(text, 403)

    def _is_token(self, given: str) -> bool:
        return self._token is not None and secrets.compare_digest(
            given.encode(), self._token.encode()
        )


def cookie_of(scope: Scope, name: str) -> str:
    """Value of a cookie that a request brings; empty if it has none."""
    # Not http.cookies, which drops all if one is odd, as those of another port may be.
    return cookie_parser(Headers(scope=scope).get("cookie", "")).get(name, "")
