"""Access to the live rig: other addresses, foreign pages, malformed and flooding messages refused."""

from live_browser import IN_BROWSER, PATIENCE, frame
from waiting import window

pytestmark = IN_BROWSER


def test_only_the_page_has_its_address(page, address):
    tried = page.evaluate(
        """() => Promise.all(["/", "/frame", "/nothing", "/frame/", "/frame/x", "/index.html", "/_nicegui/no"].map(
            (path) => fetch(path).then((r) => r.status)))"""
    )
    assert tried == [200, 200, 404, 404, 404, 404, 404]


def test_malformed_events_are_dropped_without_a_traceback(page, address, rig):
    before = len(rig.lines)
    page.evaluate(
        """async (place) => {
            const client = document.documentElement.innerHTML.match(/"?client_id"?[^0-9a-f]*([0-9a-f-]{36})/)[1];
            const s = new WebSocket(place.replace("http", "ws") + "_nicegui_ws/socket.io/?EIO=4&transport=websocket");
            await new Promise((done) => { s.onopen = done; });
            s.send("40");
            const events = [["event"], ["event", {}], ["event", 5], ["event", {client_id: client}],
                ["event", {client_id: client, id: 1, listener_id: "no", args: ["{"]}], ["handshake", {}],
                ["handshake", null], ["javascript_response", {client_id: client}], ["ack", {client_id: client}],
                ["log", {client_id: client, level: "no"}], ["nothing", {}], [null], "text", 7];
            for (let id = 0; id < 80; id++)
                events.push(["event", {client_id: client, id, listener_id: "1", args: ['{"a": 1}', "[]"]}]);
            for (const event of events) s.send("42" + JSON.stringify(event));
            await new Promise((done) => setTimeout(done, 1500));
            s.close();
        }""",
        address.split("?")[0],
    )
    then = frame(page)["time"]
    page.wait_for_function(f"window.rotorsimFrame.time > {then} + 0.1", timeout=PATIENCE * 1e3)
    assert not [line for line in rig.lines[before:] if "Traceback" in line or line.startswith("  File")]


def test_a_strangers_page_cannot_drive_the_rig(browser, page, address):
    stranger = window(browser)
    stranger.route("http://evil.example/*", lambda route: route.fulfill(body="<p>evil</p>", content_type="text/html"))
    stranger.goto("http://evil.example/")
    place = address.split("?")[0]
    tried = stranger.evaluate(
        """async (place) => {
            const read = await fetch(place + "frame", { credentials: "include" }).then(() => "read", () => "refused");
            const socket = await new Promise((done) => {
                const path = "_nicegui_ws/socket.io/?EIO=4&transport=websocket";
                const s = new WebSocket(place.replace("http", "ws") + path);
                s.onopen = () => done("open"); s.onerror = () => done("refused");
            });
            return [read, socket];
        }""",
        place,
    )
    assert tried == ["refused", "refused"]
    stranger.context.close()


def test_malformed_huge_and_flooding_messages_are_refused_and_the_plant_runs_on(page, address):
    ended = page.evaluate(
        """async (place) => {
            const ended = [];
            const url = place.replace("http", "ws") + "_nicegui_ws/socket.io/?EIO=4&transport=websocket";
            for (const messages of [["nonsense", "4", "42{", "40"], ["x".repeat(200000)], Array(5000).fill("2probe")]) {
                ended.push(await new Promise((done) => {
                    const s = new WebSocket(url);
                    s.onopen = () => {
                        for (const m of messages) s.send(m);
                        setTimeout(() => { s.close(); done("kept"); }, 4000);
                    };
                    s.onclose = () => done("ended");
                }));
            }
            return ended;
        }""",
        address.split("?")[0],
    )
    assert ended[1:] == ["ended", "ended"]
    then = frame(page)["time"]
    page.wait_for_function(f"window.rotorsimFrame.time > {then} + 0.2", timeout=PATIENCE * 1e3)
