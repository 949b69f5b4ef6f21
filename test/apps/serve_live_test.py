"""serve_live_test.py COMMAND MAP [unittest's arguments]: what `octosurf serve` and `map --serve` tell over /live."""

import pathlib
import subprocess
import sys
import tempfile
import time
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
        self.addCleanup(live.close)
        return live

    def test_the_whole_map_comes_first(self):
        of_file = self.server.ask("/api/surfaces")[1]
        for query in ("", "?since=1&run=another", "?since=999999999&run="):
            live = self.live(query)
            self.assertEqual((live.status, live.reply.getheader("Content-Type")), (200, "text/event-stream"))
            told = live.message()
            self.assertEqual((told["kind"], told["since"], told["revision"]), ("changes", None, of_file["revision"]))
            self.assertEqual([s["id"] for s in told["surfaces"]], [s["id"] for s in of_file["surfaces"]])
        self.assertTrue(self.live(f"?since={of_file['revision']}&run=").lines()[0].startswith(b":"), "it has it all")

    def test_voxels(self):
        for slices in (0, 1):
            status, packed = self.server.ask("/api/voxels", slices=slices)
            told = serving.block(packed)
            self.assertEqual((status, told["kind"], "slices" in told), (200, "voxels", slices == 1))
            self.assertGreater(told["arrays"]["voxel_x"][2], 1000)

    def test_who_may_not_ask_is_not_let_in(self):
        for status, headers in ((403, {"Origin": "http://rebound.example"}), (421, {"Host": "rebound.example"})):
            self.assertEqual(self.live(headers=headers).status, status)
        self.assertEqual(self.live("?since=soon").status, 400)
        self.assertEqual(self.live("?colour=1").status, 400)
        self.assertEqual(self.server.ask("/live", method="POST")[0], 405)

    def test_so_many_and_no_more(self):
        lives = [self.live() for _ in range(40)]
        self.assertEqual(sorted({live.status for live in lives}), [200, 503])
        self.assertEqual(self.server.ask("/api/info")[0], 200)
        for live in lives:
            live.close()
        time.sleep(1)
        self.assertEqual(self.live().status, 200, "who has gone makes room")


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
                                "--detection-budget", "0", verb="map", port="--serve") as server:
                stuck = serving.Live(server)
                live, known, messages, resyncs, compared, with_stairs = serving.Live(server), {}, 0, 0, 0, 0
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
                            self.assertEqual(told.get("stairs", []), whole["stairs"])
                            with_stairs += "stairs" in told
                        if messages % 5 == 0:  # comes back with what it knows
                            resyncs += 1
                            live.close()
                            live = serving.Live(server, f"?since={revision}&run={told['run']}")
                except OSError:  # the run is over
                    live.close()
                self.assertEqual(server.process.wait(timeout=60), 0)
                stuck.close()
            self.assertGreater(min(messages, compared, resyncs, with_stairs), 1)

    def test_deltas_add_up_and_the_map_is_the_same(self):
        with tempfile.TemporaryDirectory() as folder:
            command("simulate", "stairs", "-o", f"{folder}/scans", "--frames", "90", "--noise-scale", "0")
            command("map", f"{folder}/scans", "-o", f"{folder}/alone")
            with serving.Server(COMMAND, f"{folder}/scans", "-o", f"{folder}/served", "--realtime", "--together", "1",
                                "--detection-budget", "0", verb="map", port="--serve") as server:
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
