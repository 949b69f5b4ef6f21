"""The command, sys.argv[1], as its tests in Python run it; a running `octosurf serve`, and requests to it that no well-behaved client
would send."""

import contextlib
import gzip
import http.client
import json
import os
import pathlib
import random
import re
import select
import signal
import socket
import struct
import subprocess
import sys
import urllib.parse

def command(*words, code=0, **how):
    """What it says on stdout, or on stderr where it is to fail. With None as code it may end as it likes."""
    program = sys.argv[1] + ("-lab" if words[0] == "simulate" else "")
    done = subprocess.run([program, *map(str, words)], capture_output=True, text=True, timeout=900, **how)
    assert code is None or done.returncode == code, (words, done)
    return done.stderr if code else done.stdout


class Server:
    """`with Server("maps/office") as server:`; it has to end well on SIGTERM."""

    def __init__(self, map_name, *options, verb="serve", port="--port"):
        self.process = subprocess.Popen([sys.argv[1], verb, map_name, port, "0", *options],
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        while not (line := self.process.stdout.readline()).startswith("serving") and line:
            pass
        found = re.fullmatch(r"serving http://127\.0\.0\.1:(\d+)/\n", line)
        if not found:
            raise AssertionError(f"said {line!r} and {self.process.communicate()[1]!r}")
        self.port = int(found[1])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        out, err = self.process.communicate(timeout=60)
        assert self.process.returncode == 0, (self.process.returncode, out, err)

    def connection(self):
        return http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)

    def ask(self, path, method="GET", headers=None, body=None, plain=False, **query):
        """Status and body; JSON is read, unless it is to stay `plain`. Lists are given with commas."""
        with contextlib.closing(self.connection()) as line:
            line.request(method, url(path, **query), body=body, headers=headers or {})
            reply = line.getresponse()
            content = reply.read()
        if reply.getheader("Content-Type") == "application/json" and content and not plain:
            content = json.loads(content)
        return reply.status, content

    def raw(self, data):
        """What comes back for these bytes, until the server closes."""
        with self.half_open(b"") as line:
            answer = b""
            with contextlib.suppress(OSError):  # of what is sent after a reply
                line.sendall(data)
                line.shutdown(socket.SHUT_WR)
            while piece := line.recv(65536):
                answer += piece
            return answer

    def half_open(self, data):
        """A connection that has sent this and will send nothing more."""
        line = socket.create_connection(("127.0.0.1", self.port), timeout=60)
        line.sendall(data)
        return line

    def most_memory_mb(self):
        status = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
        return int(re.search(r"VmHWM:\s+(\d+) kB", status)[1]) / 1000


def is_open(line):
    """Whether the server has not closed this connection, on which it sends nothing."""
    return not select.select([line], [], [], 0)[0]


def in_url(query):
    """Lists with commas."""
    return {name: ",".join(map(repr, value)) if isinstance(value, list) else value for name, value in query.items()}


def url(path, **query):
    return path + ("?" + urllib.parse.urlencode(in_url(query)) if query else "")


def block(packed):
    """The JSON of what is packed for the page."""
    whole = gzip.decompress(packed)
    length, = struct.unpack("<I", whole[:4])
    return json.loads(whole[4:4 + length])


def odd_text(rng):
    return rng.choice([
        "NaN", "Infinity", "-Infinity", "1e999", "-1e308", "1e-320", "9" * 400, "-0", "-7", "4294967296", "0x10", "null", "",
        "[" * rng.randrange(300), "1," * rng.randrange(6), "".join(chr(rng.randrange(1, 0x2fff)) for _ in range(80))])


def nearly_right(rng, parameter):
    """A value of a parameter: right, at or over its limits, or odd."""
    if rng.randrange(20) == 0:
        return odd_text(rng)
    return rng.choice(parameter)


def odd_request(rng, questions):
    """The bytes of a request that may be anything."""
    question, body, head, method, query = rng.choice(questions), b"", "Host: localhost\r\nConnection: close\r\n", "GET", b""
    kind = rng.randrange(7)
    if kind == 0:
        return rng.randbytes(rng.randrange(600))
    if kind == 1:  # random bytes in the first line
        return b"GET " + rng.randbytes(rng.randrange(100)).replace(b"\n", b"") + b" HTTP/1.1\r\nHost: localhost\r\n\r\n"
    if kind == 2:  # odd fields
        method, names = rng.choice(["GET", "POST", "FOO"]), ["X", "Host", "Content-Length", "Transfer-Encoding", "Range", "Expect"]
        values = ["localhost", "-1", "9" * 30, "chunked", "x" * rng.randrange(20000), "12"]
        head = "".join(f"{rng.choice(names)}: {rng.choice(values)}\r\n" for _ in range(rng.randrange(8)))
    if kind == 3:
        method, body = rng.choice(["GET", "POST"]), rng.randbytes(rng.choice([0, 9, 90000]))
        head += f"Content-Length: {len(body)}\r\n"
    if kind > 3:
        query = urllib.parse.urlencode(in_url({name: nearly_right(rng, one)
                                               for name, one in question.get("parameters", {}).items()})).encode()
    if kind == 4 and query:  # a byte of it wrong
        at = rng.randrange(len(query))
        query = query[:at] + rng.randbytes(1) + query[at + 1:]
    return f"{method} {question['path']}?".encode() + query + f" HTTP/1.1\r\n{head}\r\n".encode() + body


STATUS_LINE = re.compile(rb"HTTP/1\.[01] (\d{3}) ")


def fuzz(server, rng, count, half_open=50):
    """How often each status was answered; "none" where there was no HTTP to answer."""
    statuses, open_lines = {}, []
    questions = [{"path": path} for path in ("/", "/api/voxels", "/nothing")]
    questions.append({"path": "/api/changes", "parameters": {"since": [0, 1, 2**53, -1, 1.5], "run": ["", "another"]}})
    for _ in range(count):
        data = odd_request(rng, questions)
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
