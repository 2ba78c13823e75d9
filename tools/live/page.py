"""The page of --live, served to this machine alone: the page itself, and the steps as server-sent events."""
import http.server
import json
import pathlib
import webbrowser

from steps import NO_FLAGS, names

PAGE = pathlib.Path(__file__).with_name("page.html")
POLICY = ("default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; connect-src 'self'; "
          "img-src data:; base-uri 'none'; form-action 'none'")


def text_of(rate):
    known = {kind: {str(number): name for number, name in table.items() if (kind, name) not in NO_FLAGS}
             for kind, table in names().items()}
    return PAGE.read_text(encoding="utf-8").replace('"SETTINGS"', json.dumps({"rate": rate, "names": known}))


def handler_of(steps, rate):
    class Handler(http.server.BaseHTTPRequestHandler):
        def log_message(self, *_):
            """Nobody wants to read of each request."""

        def begin(self, kind):
            self.send_response(200)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Security-Policy", POLICY)
            self.send_header("Cache-Control", "no-store")
            self.end_headers()

        def send_steps(self):
            self.begin("text/event-stream; charset=utf-8")
            sent = 0
            while lines := steps.wait(sent):
                sent += len(lines)
                self.wfile.write("".join(f"data: {line}\n\n" for line in lines).encode())
            self.wfile.write(f"event: end\ndata: {json.dumps(steps.said)}\n\n".encode())

        def do_GET(self):
            # A page of elsewhere that a name of its own leads here is not answered.
            if self.headers.get("Host") not in (f"127.0.0.1:{self.server.server_port}",
                                                f"localhost:{self.server.server_port}"):
                self.send_error(403)
            elif self.path == "/":
                self.begin("text/html; charset=utf-8")
                self.wfile.write(text_of(rate).encode())
            elif self.path == "/steps":
                try:
                    self.send_steps()
                except (BrokenPipeError, ConnectionResetError):
                    pass  # the page was closed
            else:
                self.send_error(404)

    return Handler


def serve(steps, rate, has_browser):
    """Until it is interrupted."""
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler_of(steps, rate)) as server:
        server.daemon_threads = True
        address = f"http://127.0.0.1:{server.server_port}/"
        print(f"{steps.head['scenario']}: {address} (for this machine only; Ctrl-C ends it)", flush=True)
        if has_browser:
            webbrowser.open(address)
        server.serve_forever()
