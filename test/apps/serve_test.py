"""serve_test.py COMMAND MAP [unittest's arguments]: `octosurf serve` and `map --serve` as their clients meet them."""

import contextlib
import json
import pathlib
import resource
import signal
import sys
import tempfile
import time
import unittest

import serving
from serving import command

MAP = sys.argv[2]


class Served(unittest.TestCase):
    """One server for all."""

    @classmethod
    def setUpClass(cls):
        cls.server = serving.Server(MAP)
        cls.addClassCleanup(cls.server.__exit__)
        whole = cls.server.ask("/api/changes")[1]
        cls.surfaces, cls.revision = whole["now"]["surfaces"], whole["revision"]


class Answers(Served):
    def answer(self, path, **parameters):
        status, answer = self.server.ask(path, **parameters)
        self.assertEqual(status, 200, answer)
        return answer

    def test_documents(self):
        info = json.loads(command("info", MAP, "--json"))
        self.assertEqual((self.revision, len(self.surfaces)), (info["revision"], info["surfaces"]))
        status, packed = self.server.ask("/api/voxels")
        voxels = serving.block(packed)
        self.assertEqual((status, voxels["kind"]), (200, "voxels"))
        self.assertGreater(voxels["arrays"]["voxel_x"][2], 1000)
        with tempfile.TemporaryDirectory() as folder:
            try:
                command("view", MAP, "--html", f"{folder}/x.html")
            except AssertionError as built_without:
                self.assertIn("built without the page", str(built_without))
                self.assertEqual(self.server.ask("/")[0], 400)
            else:
                status, page = self.server.ask("/")
                self.assertEqual((status, page), (200, pathlib.Path(folder, "x.html").read_bytes()))

    def test_changes(self):
        revision = self.revision
        for since in (0, revision // 2, revision):
            changes = self.answer("/api/changes", since=since)
            now = [s["id"] for s in self.surfaces if s["revision"] > since]
            self.assertEqual([s["id"] for s in changes["now"]["surfaces"]], now)
            self.assertEqual(sorted(changes["appeared"] + changes["changed"]), now)
            self.assertEqual(changes["revision"], revision)

    def test_the_head_of_an_answer(self):
        self.assertEqual(self.server.ask("/api/changes", method="HEAD"), (200, b""))
        for headers in ({"Range": "bytes=0-5"}, {"Accept-Encoding": "gzip, br"}, {"Expect": "100-continue"}):
            status, told = self.server.ask("/api/changes", headers=headers)
            self.assertEqual((status, "now" in told), (200, True), headers)

    def test_changes_of_an_unknown_revision_are_the_whole_map(self):
        revision = self.revision
        for known in ({}, {"since": 1, "run": "another"}, {"since": 999999999}):
            told = self.answer("/api/changes", **known)
            self.assertEqual((told["kind"], told["since"], told["now"]["revision"]), ("surfaces", None, revision))
            self.assertEqual([s["id"] for s in told["now"]["surfaces"]], [s["id"] for s in self.surfaces])
        self.assertEqual(self.answer("/api/changes", since=revision)["now"]["surfaces"], [], "it has it all")


class Refusals(Served):
    def refused(self, status, where, path, **more):
        got, body = self.server.ask(path, **more)
        self.assertEqual(got, status, body)
        self.assertEqual(set(body), {"error", "where", "hint"})
        self.assertEqual(body["where"], where, body)

    def test_bad_questions(self):
        for where, path, parameters in (
                ("since", "/api/changes", {"since": "soon"}), ("since", "/api/changes", {"since": "-1"}),
                ("since", "/api/changes", {"since": "9" * 40}), ("since", "/api/changes?since=1&since=2", {}),
                ("since", "/api/changes?since=%2", {}), ("colour", "/api/changes", {"colour": 1}),
                ("request", "/api/changes?si%00nce=1", {}), ("request", "/api/changes?run=x%00", {})):
            self.refused(400, where, path, **parameters)

    def test_other_requests(self):
        for status, where, path, more in (
                (404, "/nothing", "/nothing", {}), (405, "/api/voxels", "/api/voxels", {"method": "POST", "body": "{}"}),
                (405, "/", "/", {"method": "DELETE"}), (405, "/api/changes", "/api/changes", {"method": "POST"}),
                (413, "body", "/api/changes", {"body": "x" * 2000}), (400, "request", "/", {"headers": {"X-Long": "x" * 9000}})):
            self.refused(status, where, path, **more)
        with self.server.half_open(b"hello\r\n\r\n") as line:
            self.assertIn(b" 400 ", line.recv(4096))

    def test_no_reset_follows_a_refusal(self):
        head = b" /api/changes HTTP/1.1\r\nHost: localhost\r\n"
        for status, request in ((405, b"POST" + head + b"Content-Length: 300000\r\n\r\n" + 300000 * b"x"),
                                (400, b"GET" + head + b"A: " + 9000 * b"x" + b"\r\n\r\n")):
            for _ in range(4):
                self.assertIn(b" %d " % status, self.server.raw(request)[:20])

    def test_pages_of_other_sites_cannot_ask(self):
        for path in ("/api/voxels", "/api/changes"):
            self.refused(421, "Host", path, headers={"Host": "rebound.example:80"})
            self.refused(421, "Host", path, headers={"Host": "127.0.0.1.rebound.example"})
            self.refused(403, "Origin", path, headers={"Origin": "http://rebound.example"})
        for host in ("localhost", "127.0.0.1:99", "[::1]:80", "LocalHost:1"):
            status = self.server.ask("/api/changes", headers={"Host": host, "Origin": f"http://{host}"})[0]
            self.assertEqual(status, 200, host)

    def test_it_answers_after_many_bad_requests(self):
        statuses = serving.fuzz(self.server, serving.world(), 600)
        print(dict(sorted(statuses.items(), key=str)))
        self.assertIsNone(self.server.process.poll())
        self.assertEqual(self.server.ask("/api/changes")[0], 200)
        self.assertNotIn(500, statuses)
        for expected in (200, 400, 404, 405, 413):
            self.assertIn(expected, statuses, "the requests are not as odd as they should be")


class Limits(unittest.TestCase):
    """Clients that behave badly, and a stop."""

    def setUp(self):
        self.server = serving.Server(MAP)
        self.addCleanup(self.server.__exit__)

    def half_open(self, data, count=1):
        lines = [self.server.half_open(data) for _ in range(count)]
        for line in lines:
            self.addCleanup(line.close)
        return lines

    def ends_soon(self, number=signal.SIGTERM):
        self.server.process.send_signal(number)
        self.assertEqual(self.server.process.wait(timeout=3), 0)

    def test_wrong_use(self):
        self.assertIn("nothing.surfaces", command("serve", "nothing", code=1))
        self.assertIn("port", command("serve", MAP, "--port", self.server.port, code=2))

    def test_endless_headers_take_no_memory(self):
        before = self.server.most_memory_mb()
        for line in (b"a:\r\n", b"a" * 1000):
            answer = self.server.raw(b"GET / HTTP/1.1\r\nHost: localhost\r\n" + line * (60_000_000 // len(line)))
            self.assertRegex(answer, b"^(HTTP/1.1 400 |$)")  # it may be lost, as the server does not read on
        self.assertLess(self.server.most_memory_mb(), before + 10)
        self.assertEqual(self.server.ask("/api/changes")[0], 200)

    def test_slow_clients_delay_nobody_and_are_dropped(self):
        slow, begin = self.half_open(b"GET / HTTP/1.1\r\nX: ", 64), time.monotonic()
        while slow := [line for line in slow if serving.is_open(line)]:
            for line in slow:
                line.send(b"x")
            self.assertLess(time.monotonic() - begin, 8)
            asked = time.monotonic()
            self.assertEqual(self.server.ask("/api/changes")[0], 200)
            self.assertLess(time.monotonic() - asked, 1)
            time.sleep(0.5)

    def test_slow_clients_do_not_delay_the_end(self):
        self.half_open(b"GET / ")
        self.half_open(b"GET /api/voxels HTTP/1.1\r\nHost: localhost\r\n\r\n")
        self.ends_soon()

    def test_too_many_clients(self):
        idle = self.half_open(b"", 256)
        status, refused = self.server.ask("/api/changes")
        self.assertEqual((status, refused["error"]), (503, "too many requests at once"))
        idle[0].close()
        while self.server.ask("/api/changes")[0] != 200:
            time.sleep(0.1)

    def test_it_goes_on_after_it_had_no_descriptors(self):
        resource.prlimit(self.server.process.pid, resource.RLIMIT_NOFILE, (64, 64))
        lines = self.half_open(b"", 100)
        time.sleep(0.5)
        for line in lines:
            line.close()
        self.assertEqual(self.server.ask("/api/changes")[0], 200)


class WhileMapping(unittest.TestCase):
    """A recording's last scan comes a minute after the others, so that the map waits; it is saved at the end."""
    SCANS = 40

    def test_what_is_told_adds_up_and_the_map_is_the_same(self):
        with tempfile.TemporaryDirectory() as folder:
            scans, served, alone = (pathlib.Path(folder, name) for name in ("scans", "served", "alone"))
            command("simulate", "stairs", "--sensor", "spinning", "-o", scans, "--frames", self.SCANS + 1)
            lines = [line.split() for line in (scans / "poses.txt").read_text().splitlines()]
            for number, line in enumerate(lines):  # s: a slow machine falls behind, but joins no scans
                line[0] = f"{0.5 * number + 55 * (number == self.SCANS):.6f}"
            (scans / "poses.txt").write_text("".join(" ".join(line) + "\n" for line in lines))
            server = serving.Server(str(scans), "-o", str(served), "--realtime", "--detection-budget", "0",
                                    "--resolution", "0.04", verb="map", port="--serve")
            stuck = [server.half_open(data) for data in (b"GET / ", b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")]
            try:
                self.follow(server)
            finally:
                server.process.terminate()
                self.assertIn(f"{self.SCANS} scans mapped and saved", server.process.communicate(timeout=20)[1])
            for line in stuck:
                line.close()
            command("map", scans, "-o", alone, "--first", self.SCANS, "--resolution", "0.04")
            self.assertEqual(command("info", alone, "--digest"), command("info", served, "--digest"))

    def follow(self, server):
        """By what has changed, until the map waits: at each revision that is met whole, the two are the same."""
        messages, told_of, known, since = 0, {}, {}, None
        status, page = server.ask("/")
        self.assertIn(status, (200, 400))  # 400: built without the page
        self.assertEqual(status == 200, b'name="octosurf-run"' in (page if status == 200 else b""))
        while since != self.SCANS:
            told = server.ask("/api/changes", **known)[1]
            self.assertEqual(told["since"], since)  # an unknown `since` would be the whole map
            for gone in {*told["gone"], *(successor["id"] for successor in told["merged"])}:
                del told_of[gone]
            told_of.update((s["id"], s) for s in told["now"]["surfaces"])
            messages += since != told["revision"]
            since = told["revision"]
            known = {"since": since, "run": told["run"]}
            whole = server.ask("/api/changes")[1]["now"]
            if whole["revision"] == since:
                self.assertEqual([told_of[i] for i in sorted(told_of)], whole["surfaces"])
                self.assertEqual(told["now"].get("stairs", []), whole.get("stairs", []))
            time.sleep(0.05)
        self.assertEqual(whole["revision"], self.SCANS)
        self.assertGreater(messages, 1)
        self.assertTrue(whole.get("stairs"))


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]], verbosity=2)
