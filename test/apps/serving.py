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
    "/api/regions", "/api/regions/all", "/api/changes", "/api/plan", "/api/voxels")
EVERYTHING = QUESTIONS + ("/live", "/", "/api", "/api/info", "/api/surfaces", "/nothing")


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

    def ask(self, path, method="GET", headers=None, connection=None, body=None, **query):
        """Status and body; JSON is read. Lists are given with commas."""
        if query:
            path += "?" + urllib.parse.urlencode({
                name: ",".join(map(repr, value)) if isinstance(value, list) else value
                for name, value in query.items()})
        line = connection or self.connection()
        line.request(method, path, body=body, headers=headers or {})
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


def block(packed):
    """The JSON of what is packed for the page."""
    whole = gzip.decompress(packed)
    length, = struct.unpack("<I", whole[:4])
    return json.loads(whole[4:4 + length])


class Live:
    """The events of /live."""

    def __init__(self, server, query="", headers=None, timeout=60):
        self.line = server.connection(timeout)
        self.line.request("GET", "/live" + query, headers=headers or {})
        self.reply = self.line.getresponse()
        self.status = self.reply.status

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self.reply.close()
        self.line.close()

    def lines(self):
        """Of the next event or comment."""
        lines = []
        while (line := self.reply.readline()) != b"\n":
            if not line:
                raise ConnectionResetError("closed")
            lines.append(line.rstrip(b"\n"))
        return lines

    def message(self):
        """What the next event says."""
        while (lines := self.lines())[0].startswith(b":"):
            pass
        assert lines[0] == b"event: changes" and lines[1].startswith(b"data: ") and len(lines) == 2, lines
        return block(base64.b64decode(lines[1].removeprefix(b"data: ")))


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
        "changes": {"since": rng.choice([0, 1, 7, 2**53 - 1, 0.5])}, "voxels": {"slices": rng.choice([0, 1, 2])},
        "plan": {"from": place(4), "to": place(4), "time_s": 0.01, "robot": rng.choice(["biped", "quadruped"]),
                 "foot": rng.choice(feet)},
    }[path.rsplit("/", 1)[1]]


def odd_request(rng):
    """The bytes of a request that may be anything."""
    kind = rng.randrange(9)
    if kind == 0:
        return rng.randbytes(rng.randrange(600))
    path = rng.choice(EVERYTHING)
    if kind == 1:  # random bytes for a head
        return b"GET " + rng.randbytes(rng.randrange(100)).replace(b"\n", b"") + b" HTTP/1.1\r\nHost: localhost\r\n\r\n"
    if kind == 2:  # odd head lines
        names = ["X", "Host", "Content-Length", "Transfer-Encoding", "Connection", "Range", "Expect"]
        head = "".join(f"{rng.choice(names)}: "
                       f"{rng.choice(['localhost', '-1', '9' * 30, 'chunked', 'x' * rng.randrange(20000), '12'])}\r\n"
                       for _ in range(rng.randrange(8)))
        return f"{rng.choice(['GET', 'POST', 'PUT', 'FOO'])} {path} HTTP/1.{rng.randrange(3)}\r\n{head}\r\n".encode()
    if kind == 3:  # a body
        data = rng.randbytes(rng.choice([0, 9, 90000]))
        return (f"{rng.choice(['GET', 'POST'])} {path} HTTP/1.1\r\nHost: localhost\r\n"
                f"Content-Length: {len(data)}\r\n\r\n").encode() + data
    if kind < 6:  # odd parameters
        query = "&".join(f"{rng.choice(NAMES)}={urllib.parse.quote(odd_value(rng)[:300], safe='%,')}"
                         for _ in range(rng.randrange(6)))
    else:
        path = rng.choice(QUESTIONS)
        query = urllib.parse.urlencode({name: ",".join(map(repr, value)) if isinstance(value, list) else value
                                        for name, value in nearly_right(rng, path).items()})
    query = query.encode()
    if kind == 6 and query:  # nearly right, a byte of it wrong
        at = rng.randrange(len(query))
        query = query[:at] + rng.randbytes(1) + query[at + 1:]
    return f"GET {path}?".encode() + query + b" HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"


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
