"""No request of another site does anything."""

from pathlib import Path

import pytest
from web_client import Client, serving

from chartless.web import _page

CHANGES = [
    ("POST", "/api/session"),
    ("PUT", "/api/files?name=a.png"),
    ("POST", "/api/cameras"),
    ("DELETE", "/api/cameras/1"),
    ("PATCH", "/api/files/1"),
]


@pytest.mark.parametrize("host", ["evil.example", "evil.example:{port}", "127.0.0.1", "", "[::1]"])
@pytest.mark.parametrize("path", ["/", "/api/state", "/page.js"])
def test_a_name_of_theirs_for_our_address(client: Client, host: str, path: str) -> None:
    """DNS rebinding: a page of theirs whose name now stands for this computer."""
    answer = client.ask("GET", path, Host=host.format(port=client.port))

    assert answer.status in {400, 421}
    assert b"<html" not in answer.body


@pytest.mark.parametrize("odd", ['{"a": 1}', "a b", "é"])
def test_cookies_of_another_port_do_not_matter(client: Client, odd: str) -> None:
    """All ports of a computer share them."""
    client.cookies = {"other": odd, **client.cookies}

    assert client.ask("GET", "/api/state").status == 200


@pytest.mark.parametrize(("method", "path"), CHANGES)
@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Origin": "http://127.0.0.1:1"},
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
        {"X-Chartless": None},
    ],
    ids=str,
)
def test_changes_that_another_site_asks_for(
    client: Client, method: str, path: str, headers: dict[str, str | None]
) -> None:
    before = client.state

    answer = client.ask(method, path, b"{}", **headers)

    assert answer.status == 403
    assert "set-cookie" not in answer.headers
    assert client.state == before


def test_leave_for_requests_of_other_sites_is_not_given(client: Client) -> None:
    answer = client.ask(
        "OPTIONS",
        "/api/files",
        Origin="http://evil.example",
        Access_Control_Request_Headers="x-chartless",
        Access_Control_Request_Method="PUT",
    )

    assert answer.status == 403
    assert not [name for name in answer.headers if name.startswith("access-control")]


def test_reading_from_another_site(client: Client) -> None:
    cross = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "no-cors"}

    assert client.ask("GET", "/api/state", **cross).status == 403
    assert client.ask("GET", "/", **cross).status == 403
    # A link may lead here; it starts nothing.
    link = client.ask("GET", "/", Sec_Fetch_Site="cross-site", Sec_Fetch_Mode="navigate")
    assert link.status == 200
    assert "set-cookie" not in link.headers


@pytest.mark.parametrize("path", ["/", "/page.js", "/api/state", "/nowhere", "/api/cameras/1/x"])
def test_every_answer_tells_the_browser_what_it_may_do(client: Client, path: str) -> None:
    headers = client.ask("GET", path).headers

    policy = headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "script-src 'self'" in policy
    assert "frame-ancestors 'none'" in policy
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["cache-control"] == "no-store"
    assert headers["cross-origin-resource-policy"] == "same-origin"


def test_so_does_the_answer_to_what_went_wrong(
    client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(**_: object) -> str:
        msg = "<b>oh"
        raise KeyError(msg)

    monkeypatch.setattr(_page, "document", fail)
    answer = client.ask("GET", "/")

    assert answer.status == 500
    assert "please report it" in answer.error
    assert "default-src 'none'" in answer.headers["content-security-policy"]
    assert answer.headers["content-type"] == "application/json"


def test_cookies_are_of_no_use_to_scripts_or_other_sites(nobody: Client) -> None:
    cookie = Client(nobody.port).ask("POST", "/api/session").headers["set-cookie"].lower()

    assert "httponly" in cookie
    assert "samesite=strict" in cookie


@pytest.mark.slow
def test_a_browser_sees_its_own_workspace_alone(nobody: Client, frames: list[Path]) -> None:
    one, other = Client(nobody.port).begin(), Client(nobody.port).begin()
    one.put("a.png", frames[0].read_bytes())
    (file,) = one.state["files"]

    assert other.state["files"] == []
    assert other.ask("DELETE", f"/api/files/{file['id']}").status == 204
    assert one.state["files"] == [file]
    nobody.cookies = dict.fromkeys(one.cookies, "guessed")
    assert nobody.ask("GET", "/api/state").status == 401


def test_a_session_goes_on_after_a_reload(client: Client) -> None:
    cookies = dict(client.cookies)

    assert client.ask("POST", "/api/session").json == {"new": False}
    assert client.cookies == cookies


def test_websockets_are_not_answered(client: Client) -> None:
    answer = client.ask("GET", "/", Upgrade="websocket", Connection="Upgrade")

    assert answer.status in {200, 400, 403, 426}
    assert answer.status != 101


class TestToken:
    """A server that others can reach."""

    @pytest.fixture
    def stranger(self, tmp_path: Path) -> Client:
        with serving(tmp_path, hosts=None, token="secret") as client:
            yield client

    @pytest.mark.parametrize("path", ["/", "/?token=", "/?token=Secret", "/page.js", "/api/state"])
    def test_nobody_without_it_gets_in(self, stranger: Client, path: str) -> None:
        answer = stranger.ask("GET", path)

        assert answer.status == 403
        assert b"token" in answer.body
        assert stranger.ask("POST", "/api/session").status == 403

    def test_in_the_address_of_anything_but_the_page_it_does_not_count(
        self, stranger: Client
    ) -> None:
        assert stranger.ask("GET", "/api/state?token=secret").status == 403

    def test_with_it_the_page_opens_and_the_address_forgets_it(self, stranger: Client) -> None:
        answer = stranger.ask("GET", "/?token=secret", Host="camera.local:1")

        assert answer.status == 303
        assert answer.headers["location"] == "/"
        cookie = answer.headers["set-cookie"].lower()
        assert "httponly" in cookie
        assert "samesite=strict" in cookie
        assert stranger.ask("GET", "/").status == 200
        assert stranger.begin().state["files"] == []

    def test_a_wrong_cookie_does_not_count(self, stranger: Client) -> None:
        stranger.cookies = {f"chartless-token-{stranger.port}": "sécret"}

        assert stranger.ask("GET", "/").status == 403
