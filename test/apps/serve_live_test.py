"""serve_live_test.py COMMAND MAP [unittest's arguments]: what `octosurf serve` and `map --serve` tell over /live."""

import pathlib
import subprocess
import sys
import tempfile
import unittest

import serving

COMMAND, MAP = sys.argv[1:3]


def command(*words):
    program = COMMAND + ("-lab" if words[0] == "simulate" else "")
    done = subprocess.run([program, *words], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, (words, done)


class LiveMessages(unittest.TestCase):
    """/live, of a map that does not change."""

    def setUp(self):
        self.server = serving.Server(COMMAND, MAP)
        self.addCleanup(self.server.__exit__)

    def live(self, *arguments, **more):
        live = serving.Live(self.server, *arguments, **more)
        self.addCleanup(live.line.close)
        return live

    def test_tells_the_whole_map_and_then_voxels(self):
        of_file = self.server.ask("/api/surfaces")[1]
        for query in ("", "?since=1&run=another", "?since=999999999&run="):
            live = self.live(query)
            self.assertEqual(live.status, 101)
            told = live.message()
            self.assertEqual((told["kind"], told["since"], told["revision"]), ("changes", None, of_file["revision"]))
            self.assertEqual([s["id"] for s in told["surfaces"]], [s["id"] for s in of_file["surfaces"]])
        for word, slices in (("voxels", False), ("slices", True)):
            live.send(word)
            told = live.message()
            self.assertEqual((told["kind"], "slices" in told), ("voxels", slices))
            self.assertGreater(told["arrays"]["voxel_x"][2], 1000)

    def test_who_may_not_ask_is_not_let_in(self):
        for status, headers in ((403, {"Origin": "http://rebound.example"}), (421, {"Host": "rebound.example"})):
            self.assertEqual(self.live(headers=headers).status, status)
        self.assertEqual(self.live("?since=soon").status, 400)
        self.assertEqual(self.live("?colour=1").status, 400)
        self.assertEqual(self.server.ask("/live")[0], 426)

    def test_what_may_not_be_said_ends_it(self):
        for sent, kind, code in (("hello", serving.Live.TEXT, 1008), ("voxels", serving.Live.BINARY, 1008),
                                 ("x" * 65, serving.Live.TEXT, 1009), ("x" * 60000, serving.Live.BINARY, 1009)):
            live = self.live()
            live.send(sent, kind)
            self.assertEqual(live.closed(), code, sent[:9])

    def test_it_answers_after_odd_frames(self):
        ends = serving.fuzz_live(self.server, serving.world(), 1000)
        print(dict(sorted(ends.items(), key=str)))
        self.assertLessEqual({1002, 1008, 1009}, set(ends))
        self.assertIsNone(self.server.process.poll())
        self.assertEqual(self.live().message()["kind"], "changes")

    def test_so_many_and_no_more(self):
        lives = [self.live() for _ in range(40)]
        self.assertEqual(sorted({live.status for live in lives}), [101, 503])
        self.assertEqual(self.server.ask("/api/info")[0], 200)

    def test_who_answers_no_ping_is_dropped(self):
        live = self.live()
        live.message()
        kinds = set()
        with self.assertRaises(OSError):
            while True:
                kinds.add(live.frame()[0] & 0xf)
        self.assertIn(serving.Live.PING, kinds)


def live_surfaces(known, told):
    """`known` after a message, by id."""
    if told["since"] is None:
        known = {}
    for gone in told.get("gone", []):
        del known[gone]
    known.update((s["id"], s) for s in told["surfaces"])
    return known


class WhileMapping(unittest.TestCase):
    def test_live_messages_add_up_and_a_stuck_one_keeps_nobody(self):
        with tempfile.TemporaryDirectory() as folder:
            command("simulate", "stairs", "-o", f"{folder}/scans", "--frames", "90", "--noise-scale", "0")
            with serving.Server(COMMAND, f"{folder}/scans", "-o", f"{folder}/served", "--realtime", "--together", "1",
                                verb="map", port="--serve") as server:
                stuck = serving.Live(server)
                live, known, messages, resyncs, compared = serving.Live(server), {}, 0, 0, 0
                try:
                    while True:
                        told = live.message()
                        messages += 1
                        self.assertEqual(told["kind"], "changes")
                        if messages > 1:
                            self.assertEqual(told["since"], revision)  # an unknown `since` would be the whole map
                        revision, known = told["revision"], live_surfaces(known, told)
                        whole = server.ask("/api/surfaces")[1]
                        if whole["revision"] == revision:
                            compared += 1
                            self.assertEqual([(i, known[i]["revision"]) for i in sorted(known)],
                                             [(s["id"], s["revision"]) for s in whole["surfaces"]])
                        if messages % 5 == 0:  # comes back with what it knows
                            resyncs += 1
                            live.line.close()
                            live = serving.Live(server, f"?since={revision}&run={told['run']}")
                except OSError:  # the run is over
                    live.line.close()
                self.assertEqual(server.process.wait(timeout=60), 0)
                stuck.line.close()
            self.assertGreater(min(messages, compared, resyncs), 1)

    def test_deltas_add_up_and_the_map_is_the_same(self):
        with tempfile.TemporaryDirectory() as folder:
            command("simulate", "stairs", "-o", f"{folder}/scans", "--frames", "90", "--noise-scale", "0")
            command("map", f"{folder}/scans", "-o", f"{folder}/alone")
            with serving.Server(COMMAND, f"{folder}/scans", "-o", f"{folder}/served", "--realtime", "--together", "1",
                                verb="map", port="--serve") as server:
                stuck = [server.half_open(b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n" * 20) for _ in range(3)]
                known, revision, told = {}, 0, 0
                try:
                    while True:
                        changes = server.ask("/api/changes", since=revision)[1]
                        for gone in changes["gone"] + [heir["id"] for heir in changes["merged"]]:
                            del known[gone]
                        known.update((s["id"], s) for s in changes["now"]["surfaces"])
                        told += changes["revision"] > revision
                        revision = changes["revision"]
                        whole = server.ask("/api/surfaces")[1]
                        if whole["revision"] == revision:
                            self.assertEqual([known[i] for i in sorted(known)], whole["surfaces"])
                        status, page = server.ask("/")
                        self.assertIn(status, (200, 400))  # 400: built without the page
                        if status == 200:
                            self.assertIn(b'name="octosurf-run"', page)
                except OSError:  # the run is over
                    pass
                self.assertEqual(server.process.wait(timeout=60), 0)
                for line in stuck:
                    line.close()
            self.assertGreater(told, 2, "nothing was asked while the map grew")
            alone, served = (pathlib.Path(folder, f"{name}.surfaces").read_bytes() for name in ("alone", "served"))
            self.assertEqual(alone, served)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]], verbosity=2)
