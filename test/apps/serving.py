"""A running `octosurf serve`, and requests to it that no well-behaved client would send."""

import base64
import gzip
import http.client
import json
import os
import random
import re
import signal
import socket
import struct
import subprocess
import urllib.parse

PATHS = ("box", "sphere", "ray", "voxel", "nearest", "below", "foothold")
QUESTIONS = tuple(f"/api/query/{name}" for name in PATHS) + (
    "/api/regions", "/api/regions/all", "/api/changes", "/api/plan")
EVERYTHING = QUESTIONS + ("/live", "/", "/api/info", "/api/surfaces", "/openapi.json", "/nothing")


class Server:
    """`with Server(command, "maps/office") as server:`; it has to end well on SIGTERM."""

    def __init__(self, command, map_name, *options, verb="serve", port="--port", env=None):
        self.process = subprocess.Popen(
            [command, verb, map_name, port, "0", *options],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ, **(env or {})})
        while not (line := self.process.stdout.readline()).startswith("serving") and line:
            pass
        found = re.fullmatch(r"serving http://(\[?[\w.:]+?\]?):(\d+)/\n", line)
        if not found:
            raise AssertionError(f"said {line!r} and {self.process.communicate()[1]!r}")
        self.host, self.port = found[1].strip("[]"), int(found[2])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        out, err = self.process.communicate(timeout=60)
        assert self.process.returncode == 0, (self.process.returncode, out, err)

    def connection(self, timeout=60):
        return http.client.HTTPConnection(self.host, self.port, timeout=timeout)

    def ask(self, path, body=None, method=None, headers=None, connection=None, **query):
        """Status and body; JSON is read."""
        if query:
            path += "?" + urllib.parse.urlencode(query)
        headers = dict(headers or {})
        if body is not None:
            headers.setdefault("Content-Type", "application/json")
            body = body if isinstance(body, (bytes, str)) else json.dumps(body)
        line = connection or self.connection()
        line.request(method or ("GET" if body is None else "POST"), path, body=body, headers=headers)
        reply = line.getresponse()
        content = reply.read()
        if connection is None:
            line.close()
        if reply.getheader("Content-Type") == "application/json" and content:
            content = json.loads(content)
        return reply.status, content

    def raw(self, data, finish=True):
        """What comes back for these bytes; the connection may be reset."""
        with socket.create_connection((self.host, self.port), timeout=60) as line:
            answer = b""
            try:
                line.sendall(data)
                if finish:
                    line.shutdown(socket.SHUT_WR)
                while piece := line.recv(65536):
                    answer += piece
            except (ConnectionResetError, BrokenPipeError):
                pass
            return answer

    def half_open(self, data):
        """A connection that has sent this and will send nothing more."""
        line = socket.create_connection((self.host, self.port), timeout=60)
        line.sendall(data)
        return line


class Live:
    """A WebSocket at /live. `status` is 101 if the server agreed."""
    TEXT, BINARY, CLOSE, PING, PONG = 1, 2, 8, 9, 10

    def __init__(self, server, query="", headers=None, timeout=60):
        self.line = socket.create_connection((server.host, server.port), timeout=timeout)
        fields = {"Host": f"localhost:{server.port}", "Connection": "Upgrade", "Upgrade": "websocket",
                  "Sec-WebSocket-Version": "13", "Sec-WebSocket-Key": base64.b64encode(b"0123456789abcdef").decode(),
                  **(headers or {})}
        self.line.sendall((f"GET /live{query} HTTP/1.1\r\n"
                           + "".join(f"{name}: {value}\r\n" for name, value in fields.items()) + "\r\n").encode())
        self.bytes = b""
        while b"\r\n\r\n" not in self.bytes:
            self.more()
        head, self.bytes = self.bytes.split(b"\r\n\r\n", 1)
        self.status = int(STATUS_LINE.match(head)[1])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.line.close()

    def more(self):
        piece = self.line.recv(65536)
        if not piece:
            raise ConnectionResetError("closed")
        self.bytes += piece

    def take(self, count):
        while len(self.bytes) < count:
            self.more()
        piece, self.bytes = self.bytes[:count], self.bytes[count:]
        return piece

    def send(self, data, kind=TEXT):
        data = data.encode() if isinstance(data, str) else data
        length = bytes([0x80 | len(data)]) if len(data) < 126 else b"\xfe" + struct.pack(">H", len(data))
        self.line.sendall(bytes([0x80 | kind]) + length + b"\0\0\0\0" + data)

    def frame(self):
        """Kind and content of the next one."""
        first, length = self.take(2)
        if length == 126:
            length = struct.unpack(">H", self.take(2))[0]
        elif length == 127:
            length = struct.unpack(">Q", self.take(8))[0]
        return first & 0x8f, self.take(length)

    def message(self):
        """The JSON of the next binary message; pings are answered meanwhile. An int: it was closed with that code."""
        content = b""
        while True:
            kind, data = self.frame()
            if kind == 0x80 | self.PING:
                self.send(data, self.PONG)
            elif kind == 0x80 | self.CLOSE:
                return struct.unpack(">H", data[:2])[0] if data else 1005
            elif kind != 0x80 | self.PONG:
                content += data
                if kind & 0x80:
                    break
        whole = gzip.decompress(content)
        length, = struct.unpack("<I", whole[:4])
        return json.loads(whole[4:4 + length])

    def closed(self):
        """Waits for the server to close it; the code it gave, if it gave one."""
        try:
            while True:
                told = self.message()
                if isinstance(told, int):
                    return told
        except OSError:
            return None


def odd_number(rng):
    return rng.choice([
        "NaN", "Infinity", "-Infinity", "1e999", "-1e308", "1e-320", "9" * 400, "0", "-0", "1.5", "-7",
        "4294967296", "18446744073709551616", "0x10", "null", "true", '"1"', "[]", "{}", repr(rng.uniform(-9, 9))])


def odd_value(rng, depth=0):
    kind = rng.randrange(6)
    if kind < 3 or depth > 3:
        return odd_number(rng)
    if kind == 3:
        return "[" + ",".join(odd_value(rng, depth + 1) for _ in range(rng.randrange(6))) + "]"
    if kind == 4:
        return json.dumps("".join(chr(rng.randrange(1, 0x2fff)) for _ in range(rng.randrange(80))))
    return "[" * rng.randrange(20000)


NAMES = ("point", "min", "max", "center", "radius_m", "from", "direction", "max_slope_deg", "foot", "surface",
         "yaw_deg", "pieces", "edge_margin_m", "clearance_m", "gap_depth_m", "obstacle_margin_m", "to", "robot",
         "time_s", "budget", "max_up_m", "frontier_margin_m", "no_such_name")


def nearly_right(rng, path):
    """Parameters that are right or nearly so: numbers of every size in the right places."""
    def number():
        return rng.choice([rng.uniform(-10, 10), rng.uniform(-1e6, 1e6), 0, 1e-300, -1e-9, 1e6])

    def place(count=3):
        return [number() for _ in range(count)]

    feet = ("0.22x0.11", "0.03", "1e-9", "10x10", "1e9", "nan", "inf", "0", "-1", "0.1x", "x", "1e-300x1e300")
    contact = {"foot": rng.choice(feet), "edge_margin_m": abs(rng.choice([0, 0.02, 9.9, 1e-12])),
               "clearance_m": rng.choice([0, 0.1, 0.5]), "gap_depth_m": rng.choice([0, 0.03])}
    return {
        "box": {"min": place(), "max": place()}, "sphere": {"center": place(), "radius_m": abs(number())},
        "ray": {"from": place(), "direction": place()}, "voxel": {"point": place()},
        "nearest": {"point": place(), "max_slope_deg": rng.choice([0, 30, 180])}, "below": {"point": place()},
        "foothold": {"point": place(), "yaw_deg": rng.uniform(-720, 720), **contact},
        "all": {"yaw_deg": rng.uniform(-720, 720), **contact},
        "regions": {"surface": rng.choice([1, 2, 3, 7, 4294967295]), "pieces": rng.choice([0, 1, 5]), **contact},
        "changes": {"since": rng.choice([0, 1, 7, 2**53 - 1, 0.5])},
        "plan": {"from": place(4), "to": place(4), "time_s": 0.01, "robot": rng.choice(["biped", "quadruped"]),
                 "foot": rng.choice(feet)},
    }[path.rsplit("/", 1)[1]]


def odd_request(rng):
    """The bytes of a request that may be anything."""
    kind = rng.randrange(10)
    if kind == 0:
        return rng.randbytes(rng.randrange(600))
    path = rng.choice(EVERYTHING)
    if kind == 1:  # random bytes for a head
        return b"GET " + rng.randbytes(rng.randrange(100)).replace(b"\n", b"") + b" HTTP/1.1\r\nHost: localhost\r\n\r\n"
    if kind == 2:  # odd head lines
        head = "".join(f"{rng.choice(['X', 'Host', 'Content-Length', 'Transfer-Encoding', 'Connection'])}: "
                       f"{rng.choice(['localhost', '-1', '9' * 30, 'chunked', 'x' * rng.randrange(20000), '12'])}\r\n"
                       for _ in range(rng.randrange(8)))
        return f"{rng.choice(['GET', 'POST', 'PUT', 'FOO'])} {path} HTTP/1.{rng.randrange(3)}\r\n{head}\r\n".encode()
    if kind == 3:  # GET with odd parameters
        query = "&".join(f"{rng.choice(NAMES)}={urllib.parse.quote(odd_value(rng)[:300], safe='%,')}"
                         for _ in range(rng.randrange(6)))
        return f"GET {path}?{query} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode()
    if kind < 6:  # odd JSON
        body = "{" + ",".join(f'"{rng.choice(NAMES)}":{odd_value(rng)}' for _ in range(rng.randrange(6))) + "}"
    elif kind == 6:  # far too large
        body = '{"point":[' + "1," * rng.randrange(30000, 90000) + "1]}"
    else:
        path = rng.choice(QUESTIONS)
        body = json.dumps(nearly_right(rng, path))
    data = body.encode("utf-8", "replace")
    if kind == 7 and data:  # nearly right, a byte of it wrong
        at = rng.randrange(len(data))
        data = data[:at] + rng.randbytes(1) + data[at + 1:]
    head = (f"POST {path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
            f"Content-Length: {len(data)}\r\nConnection: close\r\n\r\n")
    return head.encode() + data


def odd_frames(rng):
    """What may be sent over a WebSocket that is none, or none of what may be asked."""
    kind = rng.randrange(7)
    if kind == 0:
        return rng.randbytes(rng.randrange(200))
    if kind == 1:  # a right text, its head damaged
        frame = bytearray(b"\x81\x86\0\0\0\0voxels")
        frame[rng.randrange(2)] ^= 1 << rng.randrange(8)
        return bytes(frame)
    if kind == 2:  # says it is giant
        return b"\x82\xff" + struct.pack(">Q", rng.choice([65, 2**20, 2**31, 2**63 - 1, 2**64 - 1])) + rng.randbytes(99)
    if kind == 3:  # text that is no UTF-8, or no question
        text = rng.choice([b"\xff\xfe", b"voxel", b"{}", b"", b"voxels ", rng.randbytes(60)])
        return bytes([0x81, 0x80 | len(text)]) + b"\0\0\0\0" + text
    if kind == 4:  # binary
        return b"\x82\x86\0\0\0\0voxels"
    if kind == 5:  # pieces without an end
        return b"\x01\x81\0\0\0\0v" + b"\x00\x81\0\0\0\0o" * rng.randrange(200)
    return b"\x88\x80\0\0\0\0" + b"\x89\x80\0\0\0\0" * rng.randrange(50)  # a close, and pings after it


def fuzz_live(server, rng, count):
    """How each WebSocket ended: its code, or None."""
    ends = {}
    for _ in range(count):
        with Live(server, rng.choice(["", "?since=1&run=x", "?since=0"])) as live:
            live.line.sendall(odd_frames(rng))
            try:
                live.line.shutdown(socket.SHUT_WR)
            except OSError:
                pass
            code = live.closed()
        ends[code] = ends.get(code, 0) + 1
    return ends


STATUS_LINE = re.compile(rb"HTTP/1\.[01] (\d{3}) ")


def fuzz(server, rng, count, half_open=50):
    """How often each status was answered; "none" where there was no HTTP to answer."""
    statuses, open_lines = {}, []
    for _ in range(count):
        data = odd_request(rng)
        if rng.randrange(20) == 0:  # stays open, with a part of it sent
            open_lines.append(server.half_open(data[:rng.randrange(len(data) + 1)]))
            if len(open_lines) > half_open:
                open_lines.pop(rng.randrange(len(open_lines))).close()
            status = "half open"
        else:
            found = STATUS_LINE.match(server.raw(data))
            status = int(found[1]) if found else "none"
        statuses[status] = statuses.get(status, 0) + 1
    for line in open_lines:
        line.close()
    return statuses


def world():
    """Random numbers of this run, and the seed that repeats it: OCTOSURF_TEST_SEED, else 1, or a fresh one."""
    given = os.environ.get("OCTOSURF_TEST_SEED", "1")
    seed = random.SystemRandom().randrange(2**32) if given == "random" else int(given)
    print(f"OCTOSURF_TEST_SEED={seed}", flush=True)
    return random.Random(seed)
