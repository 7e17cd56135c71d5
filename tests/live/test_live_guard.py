"""Access control of the live server: token, origin, message length and rate."""

import asyncio
from types import SimpleNamespace

import pytest

from rotorsim.live import serving
from rotorsim.live.serving import LONGEST, MOST_MESSAGES, Guard

PLACE = "127.0.0.1:8750"
TOKEN = "right"
COOKIE = f"rotorsim_8750={TOKEN}"


async def _inner(scope, receive, send):
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.accept"})
        while (await receive())["type"] == "websocket.receive":
            await send({"type": "websocket.send", "text": "heard"})
        await send({"type": "websocket.close"})
        return
    message = await receive()
    status = 200 if message["type"] == "http.request" else 499
    await send({"type": "http.response.start", "status": status, "headers": []})
    await send({"type": "http.response.body", "body": b""})


def ask(guard=None, kind="http", path="/frame", query="", method="GET", body=b"", messages=(), **headers):
    """Messages that come back for a request."""
    sent, guard = [], guard or Guard(_inner, TOKEN, "127.0.0.1", 8750)
    given = {"host": PLACE, "cookie": COOKIE} | {k.replace("_", "-"): v for k, v in headers.items()}
    scope = {
        "type": kind, "path": path, "query_string": query.encode(), "method": method,
        "headers": [(k.encode(), v.encode("latin-1")) for k, v in given.items() if v],
    }  # fmt: skip
    waiting = [{"type": "http.request", "body": body}] if kind == "http" else [{"type": "websocket.connect"}]
    waiting += [{"type": "websocket.receive", "text": text} for text in messages]
    waiting += [{"type": "websocket.disconnect", "code": 1000}]

    async def receive():
        return waiting.pop(0)

    async def send(message):
        sent.append(message)

    asyncio.run(guard(scope, receive, send))
    return sent


def test_a_page_with_the_token_is_let_in():
    assert ask()[0]["status"] == 200
    assert ask(origin=f"http://{PLACE}")[0]["status"] == 200


def test_the_address_with_the_token_gives_the_cookie_and_hides_the_token():
    answer, body = ask(path="/", query=f"token={TOKEN}", cookie="")
    assert b"url=/" in body["body"] and TOKEN.encode() not in body["body"]
    headers = dict(answer["headers"])
    assert answer["status"] == 200 and b"location" not in headers
    assert b"HttpOnly" in headers[b"set-cookie"] and b"SameSite=Strict" in headers[b"set-cookie"]


@pytest.mark.parametrize("other", ['prefs={"a":1}', "a=b=c", "odd", "rotorsim_8750=old", "x=\xe9"])
def test_cookies_of_other_servers_of_this_computer_do_not_lock_the_page_out(other):
    assert ask(cookie=f"{other}; {COOKIE}")[0]["status"] == 200
    assert ask(cookie=f"{COOKIE}; {other}")[0]["status"] == 200
    assert ask(cookie=other)[0]["status"] == 403


@pytest.mark.parametrize(
    "wrong",
    [
        {"cookie": ""},
        {"cookie": "rotorsim_8750=wrong"},
        {"cookie": "rotorsim_8751=right"},
        {"cookie": "", "path": "/", "query": "token=wrong"},
        {"cookie": "", "path": "/", "query": "token=%ff%c3"},
        {"host": "evil.example:8750"},
        {"host": ""},
        {"origin": "http://evil.example"},
        {"origin": "null"},
        {"origin": f"https://{PLACE}"},
        {"origin": "http://127.0.0.1:9999"},
    ],
)
def test_a_strangers_page_is_refused(wrong):
    assert ask(**wrong)[0]["status"] == 403


@pytest.mark.parametrize("wrong", [{}, {"origin": "http://evil.example"}, {"origin": f"http://{PLACE}", "cookie": ""}])
def test_a_strangers_socket_is_refused(wrong):
    assert ask(kind="websocket", path="/ws", **wrong) == [{"type": "websocket.close", "code": 1008}]


def test_a_socket_of_the_page_is_let_in():
    sent = ask(kind="websocket", path="/ws", origin=f"http://{PLACE}", messages=["a", "b"])
    assert [m["type"] for m in sent].count("websocket.send") == 2


def test_a_message_that_is_too_long_ends_its_connection():
    sent = ask(kind="websocket", path="/ws", origin=f"http://{PLACE}", messages=["a", "b" * (LONGEST + 1), "c"])
    assert [m["type"] for m in sent].count("websocket.send") == 1


@pytest.fixture
def one_moment(monkeypatch):
    """A clock that stands, so that a busy machine sends a flood too."""
    monkeypatch.setattr(serving, "time", SimpleNamespace(monotonic=lambda: 5.0))


def test_a_flood_of_messages_ends_its_connection(one_moment):
    sent = ask(kind="websocket", path="/ws", origin=f"http://{PLACE}", messages=["a"] * (3 * MOST_MESSAGES))
    assert [m["type"] for m in sent].count("websocket.send") <= MOST_MESSAGES


def test_long_bodies_and_too_many_of_them_are_refused(one_moment):
    assert ask(content_length=str(LONGEST + 1))[0]["status"] == 413
    assert ask(content_length="-1")[0]["status"] == 413
    assert ask(method="POST", body=b"x" * (LONGEST + 1))[0]["status"] == 499
    one = Guard(_inner, TOKEN, "127.0.0.1", 8750)
    answers = [ask(one, method="POST")[0]["status"] for _ in range(3 * MOST_MESSAGES)]
    assert answers == [200] * MOST_MESSAGES + [429] * (2 * MOST_MESSAGES)
