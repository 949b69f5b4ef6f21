"""serve_test.py COMMAND MAP [unittest's arguments]: `octosurf serve` as its clients meet it."""

import base64
import contextlib
import json
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import serving

COMMAND, MAP = sys.argv[1:3]


def command(*words, code=0):
    done = subprocess.run([COMMAND, *words], capture_output=True, text=True, timeout=300)
    assert done.returncode == code, (words, done)
    return done.stdout if code == 0 else done.stderr


def query(*words):
    return json.loads(command("query", MAP, "--json", *map(str, words)))


class Answers(unittest.TestCase):
    """Each answer is the command's."""

    @classmethod
    def setUpClass(cls):
        cls.server = serving.Server(COMMAND, MAP)
        cls.surfaces = cls.server.ask("/api/surfaces")[1]["surfaces"]
        cls.floor = max(cls.surfaces, key=lambda s: s["area_m2"] * (s["plane"]["normal"][2] > 0.9))
        # Inside it, with a foot's room.
        piece = cls.server.ask("/api/regions", surface=cls.floor["id"], pieces=1)[1]["pieces"][0]
        cls.at = [sum(p[i] for p in piece) / len(piece) for i in range(3)]

    @classmethod
    def tearDownClass(cls):
        cls.server.__exit__()

    def answer(self, path, **parameters):
        status, answer = self.server.ask(path, **parameters)
        self.assertEqual(status, 200, answer)
        if path == "/api/plan":
            del answer["prepare_ms"], answer["search_ms"]
        return answer

    def test_places(self):
        x, y, z = self.at
        box = self.answer("/api/query/box", min=[x - 1, y - 1, z - 1], max=[x + 1, y + 1, z + 1])
        self.assertEqual(box, query("--box", x - 1, y - 1, z - 1, x + 1, y + 1, z + 1))
        self.assertIn(self.floor["id"], box["surfaces"])
        self.assertEqual(self.answer("/api/query/sphere", center=self.at, radius_m=0.5),
                         query("--sphere", x, y, z, 0.5))
        for direction in ([1, 0.2, -0.3], [0, 0, 1], [0, 0, -1]):
            ray = self.answer("/api/query/ray", **{"from": [x, y, z + 0.5], "direction": direction})
            self.assertEqual(ray, query("--ray", x, y, z + 0.5, *direction))
        for dz in (0, 0.5, 90):
            self.assertEqual(self.answer("/api/query/voxel", point=[x, y, z + dz]), query("--voxel", x, y, z + dz))

    def test_nearest_and_below(self):
        x, y, z = self.at
        for question in ("nearest", "below"):
            for slope in (180, 20):
                found = self.answer(f"/api/query/{question}", point=[x, y, z + 1], max_slope_deg=slope)
                self.assertEqual(found, query(f"--{question}", x, y, z + 1, "--max-slope", slope))
        status, refused = self.server.ask("/api/query/below", point=[x, y, z - 90])
        self.assertEqual((status, refused["error"]), (404, "has no such surface below that place"))

    def test_footholds_and_regions(self):
        x, y, z = self.at
        limits = {"foot": "0.2x0.1", "edge_margin_m": 0.01, "clearance_m": 0.2, "obstacle_margin_m": 0.02,
                  "gap_depth_m": 0.03, "frontier_margin_m": 0.05, "max_slope_deg": 30}
        words = [w for name, value in limits.items()
                 for w in ("--" + name.removesuffix("_m").removesuffix("_deg").replace("_", "-"), value)]
        self.assertEqual(self.answer("/api/query/foothold", point=self.at, yaw_deg=30, **limits),
                         query("--foothold", x, y, z, 30, *words))
        region = self.answer("/api/regions", surface=self.floor["id"], yaw_deg=30, pieces=5, **limits)
        self.assertEqual(region, query("--regions", self.floor["id"], "--yaw", 30, "--pieces", 5, *words))
        self.assertTrue(region["polygons"] and region["pieces"])
        inside = [sum(p[i] for p in region["pieces"][0]) / len(region["pieces"][0]) for i in range(3)]
        self.assertTrue(self.answer("/api/query/foothold", point=inside, yaw_deg=30, **limits)["accepted"])
        everywhere = self.answer("/api/regions/all", foot="0.03", max_slope_deg=20)
        self.assertEqual([r["surface"] for r in everywhere["regions"]], [s["id"] for s in self.surfaces])
        for one in everywhere["regions"][:5]:
            self.assertEqual(one, self.answer("/api/regions", surface=one["surface"], foot="0.03", max_slope_deg=20))
        self.assertEqual(self.server.ask("/api/regions", surface=4294967295)[0], 404)

    def test_plans(self):
        # From the floor of the office to the landing of its stair.
        way = {"from": [-4.6, -0.6, 0.6, -135], "to": [-6.6, -2.7, 1.5, -135]}
        for more in ({}, {"max_up_m": 0.05}, {"robot": "quadruped", "budget": 50}):
            words = [w for name, value in {**way, **more}.items()
                     for w in ("--" + name.removesuffix("_m").replace("_", "-"),
                               *(value if isinstance(value, list) else [value]))]
            done = subprocess.run([COMMAND, "plan", MAP, "--json", *map(str, words)], capture_output=True, text=True)
            of_command = json.loads(done.stdout)
            del of_command["prepare_ms"], of_command["search_ms"]
            self.assertEqual(self.answer("/api/plan", **way, **more), of_command)
        status, refused = self.server.ask("/api/plan", **way, max_step_m=0.1)
        self.assertEqual((status, refused["where"]), (400, "max_step_m"))

    def test_documents(self):
        self.assertEqual(self.server.ask("/api/info")[1], json.loads(command("info", MAP, "--json")))
        with tempfile.TemporaryDirectory() as folder:
            command("export", MAP, "--to", f"{folder}/x.json")
            line = self.server.connection()
            self.addCleanup(line.close)
            line.request("GET", "/api/surfaces")
            self.assertEqual(line.getresponse().read(), pathlib.Path(folder, "x.json").read_bytes())
            try:
                command("view", MAP, "--html", f"{folder}/x.html")
            except AssertionError as built_without:
                self.assertIn("built without the page", str(built_without))
                self.assertEqual(self.server.ask("/")[0], 400)
            else:
                status, page = self.server.ask("/")
                told = b'<meta name="octosurf-server" content="yes">\n'
                self.assertIn(told, page)
                page = page.replace(told, b"").replace(b" connect-src 'self';", b"")
                self.assertEqual((status, page), (200, pathlib.Path(folder, "x.html").read_bytes()))

    def test_changes(self):
        revision = self.server.ask("/api/info")[1]["revision"]
        all_of_it = self.server.ask("/api/surfaces")[1]
        for since in (0, revision // 2, revision):
            changes = self.answer("/api/changes", since=since)
            now = [s["id"] for s in all_of_it["surfaces"] if s["revision"] > since]
            self.assertEqual([s["id"] for s in changes["now"]["surfaces"]], now)
            self.assertEqual(sorted(changes["appeared"] + changes["changed"]), now)
            self.assertEqual(changes["revision"], revision)
        self.assertEqual(self.server.ask("/api/changes", since=revision + 1)[0], 400)

    def test_the_list_says_what_is_asked(self):
        listed = {one["path"]: one["parameters"] for one in self.server.ask("/api")[1]["questions"]}
        self.assertEqual(set(listed), {*serving.QUESTIONS, "/live"})
        for path, parameters in listed.items():
            required = {name: self.at if one["numbers"] == 3 else one["numbers"] * [1]
                        for name, one in parameters.items() if one["required"]}
            for missing in required:
                fewer = {name: value for name, value in required.items() if name != missing}
                status, refused = self.server.ask(path, **fewer)
                self.assertEqual((status, refused["where"]), (400, missing))
            if path != "/live":
                self.assertIn(self.server.ask(path, **required)[0], (200, 404), path)

    def test_head_and_keep_alive(self):
        line = self.server.connection()
        self.addCleanup(line.close)
        for _ in range(3):
            line.request("HEAD", "/api/info")
            reply = line.getresponse()
            self.assertEqual((reply.status, reply.read()), (200, b""))
            self.assertEqual(self.server.ask("/api/info", connection=line)[0], 200)


class Refusals(unittest.TestCase):
    def setUp(self):
        self.server = serving.Server(COMMAND, MAP)
        self.addCleanup(self.server.__exit__)

    def refused(self, status, where, *ask, **more):
        got, body = self.server.ask(*ask, **more)
        self.assertEqual(got, status, body)
        self.assertEqual(set(body), {"error", "where", "mend"})
        self.assertEqual(body["where"], where, body)

    def test_bad_questions(self):
        voxel = "/api/query/voxel"
        self.refused(400, "point", voxel)
        self.refused(400, "point", voxel, point=[1, 2])
        self.refused(400, "point", voxel, point="here")
        self.refused(400, "point", voxel, point=[1, 2, 1e7])
        self.refused(400, "point", voxel, point="1,2,nan")
        self.refused(400, "point", voxel, point="1,2,1e999")
        self.refused(400, "point", voxel, point="1,2,")
        self.refused(400, "point", voxel + "?point=1,2,%2")
        self.refused(400, "point", voxel + "?point=1,2,3&point=1,2,4")
        self.refused(400, "colour", voxel, point=[1, 2, 3], colour=1)
        self.refused(400, "foot", "/api/regions", surface=1, foot="big")
        self.refused(400, "surface", "/api/regions", surface=1.5)
        self.refused(400, "robot", "/api/plan", **{"from": [0] * 4, "to": [0] * 4, "robot": "bird"})

    def test_other_requests(self):
        self.refused(404, "/nothing", "/nothing")
        self.refused(405, "/api/info", "/api/info", method="POST", body="{}")
        self.refused(405, "/api/plan", "/api/plan", method="DELETE")
        self.refused(413, "body", "/api/plan", body="x" * 70000)
        self.refused(413, "body", "/api/plan", body="x" * 900000)  # not lost in a reset connection
        self.refused(431, "header", "/", headers={"X-Long": "x" * 9000})
        self.refused(431, "header", "/", headers={f"X-{i}": "x" * 99 for i in range(99)})
        self.assertIn(b" 400 ", self.server.raw(b"hello\r\n\r\n"))

    def test_answers_are_whole_and_as_they_are(self):
        for headers in ({"Range": "bytes=0-5"}, {"Accept-Encoding": "gzip, br"}, {"Expect": "100-continue"}):
            status, surfaces = self.server.ask("/api/surfaces", headers=headers)
            self.assertEqual((status, "surfaces" in surfaces), (200, True), headers)

    def test_pages_of_other_sites_cannot_ask(self):
        self.refused(421, "Host", "/api/info", headers={"Host": "rebound.example:80"})
        self.refused(421, "Host", "/api/info", headers={"Host": "127.0.0.1.rebound.example"})
        self.refused(403, "Origin", "/api/info", headers={"Origin": "http://rebound.example"})
        for host in ("localhost", "127.0.0.1:99", "[::1]:80", "LocalHost:1"):
            status = self.server.ask("/api/info", headers={"Host": host, "Origin": f"http://{host}"})[0]
            self.assertEqual(status, 200, host)

    def test_silent_connections_do_not_keep_others_out(self):
        lines = [self.server.half_open(b"GET / HT") for _ in range(200)]
        for _ in range(20):
            self.assertEqual(self.server.ask("/api/info")[0], 200)
        for line in lines:
            line.close()

    def test_a_client_that_does_not_read_keeps_nobody_waiting(self):
        lines = [self.server.half_open(b"GET /api/surfaces HTTP/1.1\r\nHost: localhost\r\n\r\n" * 50)
                 for _ in range(10)]
        for _ in range(20):
            self.assertEqual(self.server.ask("/api/info")[0], 200)
        for line in lines:
            line.close()

    def test_it_answers_after_thousands_of_bad_requests(self):
        rng = serving.world()
        statuses = serving.fuzz(self.server, rng, 2000)
        print(dict(sorted(statuses.items(), key=str)))
        self.assertIsNone(self.server.process.poll())
        self.assertEqual(self.server.ask("/api/info")[0], 200)
        self.assertNotIn(500, statuses)
        for expected in (200, 400, 404, 405, 413):
            self.assertIn(expected, statuses, "the requests are not as odd as they should be")


class Door(unittest.TestCase):
    TOKEN = "0123456789abcdefXYZ"

    def test_the_token(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder, "token")
            file.write_text(self.TOKEN + "\n")
            file.chmod(0o600)
            with serving.Server(COMMAND, MAP, "--listen", "0.0.0.0", "--token", str(file)) as server:
                server.host = "127.0.0.1"
                self.answers_to_its_token_only(server)
        with serving.Server(COMMAND, MAP, env={"OCTOSURF_TOKEN": self.TOKEN}) as server:
            self.answers_to_its_token_only(server)

    def answers_to_its_token_only(self, server):
        def status(*authorization):
            return server.ask("/api/info", headers={"Authorization": a for a in authorization})[0]

        wrong = [self.TOKEN[:-1], self.TOKEN + "x", self.TOKEN.lower(), "", "x" * 19, self.TOKEN[1:]]
        self.assertEqual([status(f"Bearer {token}") for token in wrong], [401] * len(wrong))
        self.assertEqual([status(), status(self.TOKEN), status(f"Digest {self.TOKEN}")], [401] * 3)
        self.assertEqual(status(f"Bearer {self.TOKEN}"), 200)
        basic = base64.b64encode(f"me:{self.TOKEN}".encode()).decode()
        self.assertEqual(status(f"Basic {basic}"), 200)
        self.assertEqual(status("Basic " + base64.b64encode(b"me:no").decode()), 401)
        self.assertEqual(server.ask("/nothing")[0], 401)
        for authorization, expected in ((None, 401), ("Bearer x", 401), (f"Bearer {self.TOKEN}", 200),
                                        (f"Basic {basic}", 200)):
            headers = {"Authorization": authorization} if authorization else {}
            with serving.Live(server, headers=headers) as live:
                self.assertEqual(live.status, expected)

    def test_others_need_a_token(self):
        told = command("serve", MAP, "--listen", "0.0.0.0", code=2)
        self.assertIn("--token", told)
        with tempfile.NamedTemporaryFile("w") as file:
            file.write("short")
            file.flush()
            self.assertIn("16 letters", command("serve", MAP, "--token", file.name, code=2))
        for unreadable in ("/nothing", "/dev/zero", "/dev/null"):
            self.assertIn(unreadable, command("serve", MAP, "--token", unreadable, code=1))

    def test_wrong_use(self):
        self.assertIn("--listen", command("serve", MAP, "--listen", "moon", code=2))
        self.assertIn("nothing.surfaces", command("serve", "nothing", code=1))
        with serving.Server(COMMAND, MAP) as server:
            self.assertIn("port", command("serve", MAP, "--port", str(server.port), code=2))

    def test_ends_well_by_either_signal_and_while_it_answers(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            server = serving.Server(COMMAND, MAP)
            line = server.half_open(b"GET /api/surfaces HTTP/1.1\r\nHost: localhost\r\n\r\n" * 20)
            server.process.send_signal(number)
            self.assertEqual(server.process.wait(timeout=60), 0)
            line.close()
            server.process.communicate()

    def test_an_answer_that_is_being_made_is_sent_whole_at_the_end(self):
        wholes = 0
        for _ in range(5):  # a request that arrives too late is not answered
            with serving.Server(COMMAND, MAP) as server:
                line = server.connection()
                line.request("GET", "/api/plan?from=-4.6,-0.6,0.6,-135&to=-6.6,-2.7,1.5,-135")
                time.sleep(0.2)
                server.process.send_signal(signal.SIGTERM)
                with contextlib.suppress(ConnectionError):
                    line.getresponse().read()  # raises IncompleteRead where a part is missing
                    wholes += 1
                line.close()
                server.process.wait(timeout=60)
        self.assertGreater(wholes, 0)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]], verbosity=2)
