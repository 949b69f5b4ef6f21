"""serve_test.py COMMAND MAP [unittest's arguments]: `octosurf serve` and `map --serve` as their clients meet them."""

import base64
import contextlib
import json
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import serving

COMMAND, MAP = sys.argv[1:3]
PLAN = {"from": [-4.6, -0.6, 0.6, -135], "to": [-6.6, -2.7, 1.5, -135]}  # from the office's floor to the landing of its stair


def command(*words, code=0):
    program = COMMAND + ("-lab" if words[0] == "simulate" else "")
    done = subprocess.run([program, *map(str, words)], capture_output=True, text=True, timeout=300)
    assert code is None or done.returncode == code, (words, done)
    return done.stderr if code else done.stdout


def query(*words):
    return json.loads(command("query", MAP, "--json", *words))


def in_words(parameters):
    """A question's parameters as the command's options."""
    words = []
    for name, value in parameters.items():
        words += ["--" + name.removesuffix("_m").removesuffix("_deg").replace("_", "-")]
        words += value if isinstance(value, list) else [value]
    return words


def touches(surface, box):
    """Whether the box of its outlines meets this one."""
    corners = [corner for polygon in surface["polygons"] for corner in polygon["outer"]]
    return all(min(c[i] for c in corners) <= box[i + 3] and max(c[i] for c in corners) >= box[i] for i in range(3))


class Served(unittest.TestCase):
    """One server for all."""

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


class Answers(Served):
    """Each answer is the command's."""

    def answer(self, path, **parameters):
        status, answer = self.server.ask(path, **parameters)
        self.assertEqual(status, 200, answer)
        return answer

    def test_places(self):
        x, y, z = self.at
        box = self.answer("/api/query/box", min=[x - 1, y - 1, z - 1], max=[x + 1, y + 1, z + 1])
        self.assertEqual(box, query("--box", x - 1, y - 1, z - 1, x + 1, y + 1, z + 1))
        self.assertIn(self.floor["id"], box["surfaces"])
        self.assertEqual(self.answer("/api/query/sphere", center=self.at, radius_m=0.5), query("--sphere", x, y, z, 0.5))
        for direction in ([1, 0.2, -0.3], [0, 0, 1]):
            ray = self.answer("/api/query/ray", **{"from": [x, y, z + 0.5], "direction": direction})
            self.assertEqual(ray, query("--ray", x, y, z + 0.5, *direction))
        for dz in (0, 90):
            self.assertEqual(self.answer("/api/query/voxel", point=[x, y, z + dz]), query("--voxel", x, y, z + dz))
        for question in ("nearest", "below"):
            found = self.answer(f"/api/query/{question}", point=[x, y, z + 1], max_slope_deg=20)
            self.assertEqual(found, query(f"--{question}", x, y, z + 1, "--max-slope", 20))
        status, refused = self.server.ask("/api/query/below", point=[x, y, z - 90])
        self.assertEqual((status, refused["error"]), (404, "has no such surface below that place"))

    def test_footholds_and_regions(self):
        limits = {"foot": "0.2x0.1", "edge_margin_m": 0.01, "clearance_m": 0.2, "obstacle_margin_m": 0.02,
                  "frontier_margin_m": 0.05, "max_slope_deg": 30}
        self.assertEqual(self.answer("/api/query/foothold", point=self.at, yaw_deg=30, **limits),
                         query("--foothold", *self.at, 30, *in_words(limits)))
        region = self.answer("/api/regions", surface=self.floor["id"], yaw_deg=30, pieces=5, **limits)
        self.assertEqual(region, query("--regions", self.floor["id"], "--yaw", 30, "--pieces", 5, *in_words(limits)))
        self.assertTrue(region["polygons"] and region["pieces"])
        about = {"foot": "0.2x0.1", "unseen": 0.1, "reach_m": 0.5}
        near = self.answer("/api/regions", surface=self.floor["id"], about=self.at, **about)
        self.assertEqual(near, query("--regions", self.floor["id"], "--about", *self.at, *in_words(about)))
        self.assertTrue(0 < near["area_m2"] <= 1 + 1e-9)
        inside = [sum(p[i] for p in region["pieces"][0]) / len(region["pieces"][0]) for i in range(3)]
        self.assertTrue(self.answer("/api/query/foothold", point=inside, yaw_deg=30, **limits)["accepted"])
        everywhere = self.answer("/api/regions/all", foot="0.03", max_slope_deg=20)
        self.assertEqual([r["surface"] for r in everywhere["regions"]], [s["id"] for s in self.surfaces])
        for one in everywhere["regions"][:5]:
            self.assertEqual(one, self.answer("/api/regions", surface=one["surface"], foot="0.03", max_slope_deg=20))
        self.assertEqual(self.server.ask("/api/regions", surface=4294967295)[0], 404)

    def test_plans(self):
        for more in ({"max_up_m": 0.05}, {"robot": "quadruped", "budget": 50}):
            plans = [self.answer("/api/plan", **PLAN, **more, time_s=30),
                     json.loads(command("plan", MAP, "--json", *in_words({**PLAN, **more}), code=None))]
            for plan in plans:
                del plan["prepare_ms"], plan["search_ms"]
            self.assertEqual(*plans)
        status, refused = self.server.ask("/api/plan", **PLAN, max_step_m=0.1)
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

    def test_one_surface(self):
        for one in self.surfaces[:3] + self.surfaces[-1:]:
            self.assertEqual(self.answer("/api/surface", id=one["id"]), one)
        self.assertEqual({surface["id"] for surface in self.surfaces} & {last_id := 4294967295}, set())
        status, refused = self.server.ask("/api/surface", id=last_id)
        self.assertEqual((status, refused["error"]), (404, f"has no surface {last_id}"))
        self.assertIn("/api/surfaces", refused["hint"])

    def test_changes(self):
        revision = self.server.ask("/api/info")[1]["revision"]
        for since in (0, revision // 2, revision):
            changes = self.answer("/api/changes", since=since)
            now = [s["id"] for s in self.surfaces if s["revision"] > since]
            self.assertEqual([s["id"] for s in changes["now"]["surfaces"]], now)
            self.assertEqual(sorted(changes["appeared"] + changes["changed"]), now)
            self.assertEqual(changes["revision"], revision)
        self.assertEqual(self.server.ask("/api/changes", since=revision + 1)[0], 400)

    def test_changes_in_a_box(self):
        box = [self.at[i] + d for d in (-0.5, 0.5) for i in range(3)]
        inside = [s for s in self.answer("/api/changes", since=0)["now"]["surfaces"] if touches(s, box)]
        for corners in (box, box[3:] + box[:3]):
            self.assertEqual(self.answer("/api/changes", since=0, box=corners)["now"]["surfaces"], inside)
        self.assertTrue(0 < len(inside) < len(self.surfaces))
        line = self.server.connection()
        self.addCleanup(line.close)
        line.request("GET", "/api/changes?since=0&box=90,90,90,91,91,91")
        self.assertLess(len(line.getresponse().read()), 400, "nothing is there")

    def test_the_list_says_what_is_asked(self):
        listed = {one["path"]: one["parameters"] for one in self.server.ask("/api")[1]["questions"]}
        self.assertEqual(set(listed), serving.QUESTIONS)
        for path, parameters in listed.items():
            required = {name: self.at if one["numbers"] == 3 else one["numbers"] * [1]
                        for name, one in parameters.items() if one["required"]}
            for missing in required:
                fewer = {name: value for name, value in required.items() if name != missing}
                status, refused = self.server.ask(path, **fewer)
                self.assertEqual((status, refused["where"]), (400, missing))
            if path == "/api/clear":
                self.assertEqual(self.server.ask(path)[0], 405)
            elif path != "/live":
                self.assertIn(self.server.ask(path, **required)[0], (200, 404), path)

    def test_the_head_of_an_answer(self):
        self.assertEqual(self.server.ask("/api/info", method="HEAD"), (200, b""))
        for headers in ({"Range": "bytes=0-5"}, {"Accept-Encoding": "gzip, br"}, {"Expect": "100-continue"}):
            status, surfaces = self.server.ask("/api/surfaces", headers=headers)
            self.assertEqual((status, "surfaces" in surfaces), (200, True), headers)

    def test_live_tells_the_whole_map_first(self):
        revision = self.server.ask("/api/info")[1]["revision"]
        for asked in ("", "?since=1&run=another", "?since=999999999&run="):
            with serving.Live(self.server, asked) as live:
                self.assertEqual((live.status, live.reply.getheader("Content-Type")), (200, "text/event-stream"))
                told = live.message()
                self.assertEqual((told["kind"], told["since"], told["map"]["revision"]), ("surfaces", None, revision))
                self.assertEqual([s["id"] for s in told["map"]["surfaces"]], [s["id"] for s in self.surfaces])
        with serving.Live(self.server, f"?since={revision}&run=") as live:
            self.assertTrue(live.lines()[0].startswith(b":"), "it has it all")

    def test_voxels(self):
        status, packed = self.server.ask("/api/voxels")
        told = serving.block(packed)
        self.assertEqual((status, told["kind"]), (200, "voxels"))
        self.assertGreater(told["arrays"]["voxel_x"][2], 1000)


class Refusals(Served):
    def refused(self, status, where, path, **more):
        got, body = self.server.ask(path, **more)
        self.assertEqual(got, status, body)
        self.assertEqual(set(body), {"error", "where", "hint"})
        self.assertEqual(body["where"], where, body)

    def test_bad_questions(self):
        voxel = "/api/query/voxel"
        for point in ([1, 2], "here", [1, 2, 1e7], "1,2,nan", "1,2,1e999", "1,2,"):
            self.refused(400, "point", voxel, point=point)
        self.refused(400, "point", voxel)
        self.refused(400, "point", voxel + "?point=1,2,%2")
        self.refused(400, "point", voxel + "?point=1,2,3&point=1,2,4")
        self.refused(400, "colour", voxel, point=[1, 2, 3], colour=1)
        self.refused(400, "foot", "/api/regions", surface=1, foot="big")
        self.refused(400, "surface", "/api/regions", surface=1.5)
        self.refused(400, "robot", "/api/plan", **{"from": [0] * 4, "to": [0] * 4, "robot": "bird"})
        self.refused(400, "since", "/live", since="soon")
        self.refused(400, "colour", "/live", colour=1)

    def test_other_requests(self):
        self.refused(404, "/nothing", "/nothing")
        self.refused(405, "/api/info", "/api/info", method="POST", body="{}")
        self.refused(405, "/api/plan", "/api/plan", method="DELETE")
        status, refused = clear(self.server, {"box": [0, 0, 0, 1, 1, 1]})
        self.assertEqual((status, "octosurf clear" in refused["hint"]), (403, True), refused)
        self.refused(405, "/live", "/live", method="POST")
        self.refused(413, "body", "/api/plan", body="x" * 2000)
        self.refused(400, "request", "/", headers={"X-Long": "x" * 9000})
        with self.server.half_open(b"hello\r\n\r\n") as line:
            self.assertIn(b" 400 ", line.recv(4096))

    def test_pages_of_other_sites_cannot_ask(self):
        for path in ("/api/info", "/live"):
            self.refused(421, "Host", path, headers={"Host": "rebound.example:80"})
            self.refused(421, "Host", path, headers={"Host": "127.0.0.1.rebound.example"})
            self.refused(403, "Origin", path, headers={"Origin": "http://rebound.example"})
        for host in ("localhost", "127.0.0.1:99", "[::1]:80", "LocalHost:1"):
            status = self.server.ask("/api/info", headers={"Host": host, "Origin": f"http://{host}"})[0]
            self.assertEqual(status, 200, host)

    def test_so_many_follow_and_no_more(self):
        with contextlib.ExitStack() as stack:
            lives = [stack.enter_context(serving.Live(self.server)) for _ in range(40)]
            self.assertEqual(sorted({live.status for live in lives}), [200, 503])
            self.assertEqual(self.server.ask("/api/info")[0], 200)
        while serving.Live(self.server).status != 200:  # who has gone makes room
            time.sleep(0.1)

    def test_it_answers_after_many_bad_requests(self):
        statuses = serving.fuzz(self.server, serving.world(), 600)
        print(dict(sorted(statuses.items(), key=str)))
        self.assertIsNone(self.server.process.poll())
        self.assertEqual(self.server.ask("/api/info")[0], 200)
        self.assertNotIn(500, statuses)
        for expected in (200, 400, 404, 405, 413):
            self.assertIn(expected, statuses, "the requests are not as odd as they should be")


class Door(unittest.TestCase):
    TOKEN = "0123456789abcdefXYZ"

    def test_the_token(self):
        with tempfile.NamedTemporaryFile("w") as file:
            file.write(self.TOKEN + "\n")
            file.flush()
            with serving.Server(COMMAND, MAP, "--listen", "0.0.0.0", "--token", file.name) as server:
                server.host = "127.0.0.1"
                self.answers_to_its_token_only(server)
        with serving.Server(COMMAND, MAP, env={"OCTOSURF_TOKEN": self.TOKEN}) as server:
            self.answers_to_its_token_only(server)

    def answers_to_its_token_only(self, server):
        def status(authorization=None, path="/api/info"):
            headers = {"Authorization": authorization} if authorization else {}
            with serving.Live(server, headers=headers, path=path) as asked:
                return asked.status

        basic = [f"Basic {base64.b64encode(text.encode()).decode()}" for text in (f"me:{self.TOKEN}", "me:no")]
        for path in ("/api/info", "/live"):
            wrong = [self.TOKEN[:-1], self.TOKEN + "x", self.TOKEN.lower(), "", "x" * 19, self.TOKEN[1:]]
            self.assertEqual([status(f"Bearer {token}", path) for token in wrong], [401] * len(wrong))
            self.assertEqual([status(other, path) for other in (None, self.TOKEN, f"Digest {self.TOKEN}", basic[1])], [401] * 4)
            self.assertEqual([status(right, path) for right in (f"Bearer {self.TOKEN}", basic[0])], [200] * 2)
        self.assertEqual(server.ask("/nothing")[0], 401)

    def test_wrong_use(self):
        self.assertIn("--token", command("serve", MAP, "--listen", "0.0.0.0", code=2))
        with tempfile.NamedTemporaryFile("w") as file:
            file.write("short")
            file.flush()
            self.assertIn("16 letters", command("serve", MAP, "--token", file.name, code=2))
        for unreadable in ("/nothing", "/dev/zero", "/dev/null"):
            self.assertIn(unreadable, command("serve", MAP, "--token", unreadable, code=1))
        self.assertIn("--listen", command("serve", MAP, "--listen", "moon", code=2))
        self.assertIn("nothing.surfaces", command("serve", "nothing", code=1))
        with serving.Server(COMMAND, MAP) as server:
            self.assertIn("port", command("serve", MAP, "--port", server.port, code=2))

    def test_ends_by_either_signal_while_it_answers(self):
        wholes = 0
        for number in (signal.SIGINT, signal.SIGTERM):
            with serving.Server(COMMAND, MAP) as server:
                stuck = server.half_open(b"GET /api/surfaces HTTP/1.1\r\nHost: localhost\r\n\r\n")
                line = server.connection()
                line.request("GET", "/api/plan?from=-4.6,-0.6,0.6,-135&to=-6.6,-2.7,1.5,-135")
                time.sleep(0.2)
                server.process.send_signal(number)
                with contextlib.suppress(ConnectionError):  # one that arrives too late is not answered
                    line.getresponse().read()  # raises IncompleteRead where a part is missing
                    wholes += 1
                line.close()
                self.assertEqual(server.process.wait(timeout=60), 0)
                stuck.close()
        self.assertGreater(wholes, 0)


class Recording(unittest.TestCase):
    """Of the office, and its map."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder.name
        command("simulate", "office", "-o", f"{cls.folder}/scans", "--frames", 20)
        command("map", f"{cls.folder}/scans", "-o", f"{cls.folder}/office", "--resolution", "0.04")

    def test_a_surface_that_went_is_told_from_one_that_never_was(self):
        with serving.Server(COMMAND, f"{self.folder}/office") as server:
            there = {surface["id"] for surface in server.ask("/api/surfaces")[1]["surfaces"]}
            kinds = set()
            for missing in set(range(1, max(there))) - there:
                status, refused = server.ask("/api/surface", id=missing)
                self.assertEqual(status, 404)
                kind, revision, into = re.fullmatch(
                    rf"(?:has no )?surface {missing}(?: (was merged|went) in revision (\d+)(?:; it goes on in ([\d, ]+))?)?",
                    refused["error"]).groups()
                changes = server.ask("/api/changes", since=int(revision or 0) - bool(revision))[1]
                successors = [one["into"] for one in changes["merged"] if one["id"] == missing]
                self.assertEqual(", ".join(map(str, successors)), into or "")
                self.assertLessEqual(set(successors), there)
                self.assertEqual(missing in changes["gone"], kind == "went")
                kinds.add(kind)
            self.assertEqual(kinds, {None, "was merged", "went"})

    def test_changes_in_a_box_are_those_of_the_map_that_touch_it(self):
        with serving.Server(COMMAND, f"{self.folder}/office") as server:
            counts = {"changed": 0, "appeared": 0, "outside": 0}
            for since in range(server.ask("/api/info")[1]["revision"] + 1):
                whole = server.ask("/api/changes", since=since)[1]
                center = whole["now"]["surfaces"][0]["polygons"][0]["outer"][0] if whole["now"]["surfaces"] else [0, 0, 0]
                box = [x + d for d in (-0.3, 0.3) for x in center]
                there = [s for s in whole["now"]["surfaces"] if touches(s, box)]
                ids = {s["id"] for s in there}
                part = server.ask("/api/changes", since=since, box=box)[1]
                self.assertEqual(part["now"]["surfaces"], there)
                for kind in ("appeared", "changed"):
                    self.assertEqual(part[kind], [i for i in whole[kind] if i in ids])
                self.assertEqual(part["outside"], [i for i in whole["changed"] if i not in ids])
                self.assertEqual([part[kind] for kind in ("gone", "merged", "split")], [whole[kind] for kind in ("gone", "merged", "split")])
                for kind in counts:
                    counts[kind] += len(part[kind])
            self.assertGreater(min(counts.values()), 0, counts)


def clear(server, body, headers=None, **more):
    return server.ask("/api/clear", **{"method": "POST", **more}, body=body if isinstance(body, str) else json.dumps(body),
                      headers={"Content-Type": "application/json", **(headers or {})})


class WaitingMap:
    """A server of the map of all of a recording's scans but the last, which is saved at the end."""

    def __init__(self, folder, sensor, scene, scans):
        self.folder, self.scans = pathlib.Path(folder), scans
        command("simulate", scene, "--sensor", sensor, "-o", self.folder / "scans", "--frames", scans + 1)
        poses = self.folder / "scans/poses.txt"
        lines = [line.split() for line in poses.read_text().splitlines()]
        for number, line in enumerate(lines):
            line[0] = f"{0.5 * number:.6f}"  # s: a slow machine falls behind, but joins no scans
        lines[-1][0] = f"{0.5 * scans + 55:.6f}"  # so long the map waits, a minute at most
        poses.write_text("".join(" ".join(line) + "\n" for line in lines))

    @contextlib.contextmanager
    def served(self, test, name, *options):
        server = serving.Server(COMMAND, f"{self.folder}/scans", "-o", f"{self.folder}/{name}", "--realtime",
                                "--detection-budget", "0", "--resolution", "0.04", *options, verb="map", port="--serve")
        try:
            yield server
        finally:
            server.process.terminate()
            test.assertIn(f"{self.scans} scans mapped and saved", server.process.communicate(timeout=60)[1])

    def saved(self, name):
        return pathlib.Path(self.folder, f"{name}.surfaces").read_bytes()


class Clearing(unittest.TestCase):
    BOX = [-6.5, -2, 0.3, -3.5, 1, 1.8]

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.map = WaitingMap(folder.name, "spinning", "office", 5)

    @contextlib.contextmanager
    def waiting(self, name, *options):
        with self.map.served(self, name, *options) as server:
            while server.ask("/api/info")[1]["revision"] < 5:
                time.sleep(0.05)
            yield server

    def test_what_is_cleared_over_http_is_cleared_as_by_the_command(self):
        with self.waiting("whole") as server:
            self.assertEqual(clear(server, {"box": self.BOX})[0], 403)
            before = server.ask("/api/surfaces")[1]["surfaces"]
        said = command("clear", self.map.folder / "whole", "--box", *self.BOX, "-o", self.map.folder / "cleared")
        with self.waiting("asked", "--allow-clear") as server:
            self.refuses_all_else(server)
            far = [*self.BOX[3:], *(x + 0.5 for x in self.BOX[3:])]
            follower = serving.Live(server, f"?since=5&run={serving.Live(server).message()['run']}")
            status, cleared = clear(server, {"box": self.BOX})
            self.assertEqual(status, 200, cleared)
            self.assertEqual(follower.message()["changes"]["gone"], cleared["gone"])
            self.assertIn(f"{cleared['points']} points taken back; {len(cleared['gone'])} surfaces gone, "
                          f"{len(cleared['smaller'])} smaller, {cleared['left']} left", said)
            self.assertTrue(cleared["gone"] and cleared["smaller"] and cleared["revision"] == 6, cleared)
            status, refused = server.ask("/api/surface", id=cleared["gone"][0])
            self.assertEqual((status, refused["error"]), (404, f"surface {cleared['gone'][0]} went in revision 6"))
            self.assertEqual(server.ask("/api/query/voxel", point=[sum(self.BOX[i::3]) / 2 for i in range(3)])[1]["state"], "unknown")
            changes = server.ask("/api/changes", since=5, box=far)[1]
            self.assertEqual(sorted(changes["changed"] + changes["outside"]), cleared["smaller"])
            self.assertTrue(changes["outside"])
            self.assertEqual({s["id"] for s in changes["now"]["surfaces"]}, set(changes["changed"]))
            had = {s["id"] for s in before if touches(s, far)}
            has = {s["id"] for s in server.ask("/api/surfaces")[1]["surfaces"] if touches(s, far)}
            self.assertEqual((had - set(changes["gone"] + changes["outside"])) | set(changes["changed"]), has)
        self.assertEqual(self.map.saved("asked"), self.map.saved("cleared"))

    def refuses_all_else(self, server):
        revision = server.ask("/api/info")[1]["revision"]
        self.assertEqual(revision, 5)
        for status, where, body, more in [
                (403, "Origin", {"box": self.BOX}, {"headers": {"Origin": "http://rebound.example"}}),
                (421, "Host", {"box": self.BOX}, {"headers": {"Host": "rebound.example:80"}}),
                (415, "body", {"box": self.BOX}, {"headers": {"Content-Type": "text/plain"}}),
                (405, "/api/clear", {"box": self.BOX}, {"method": "PUT"}), (405, "/api/clear", "", {"method": "GET"}),
                (400, "body", "[1, 2]", {}), (400, "body", '{"box": ', {}), (400, "body", "[" * 4000, {}), (400, "box", {}, {}),
                (400, "box", {"box": self.BOX, "cylinder": [0, 0, 0, 1, 1]}, {}), (400, "box", {"box": self.BOX[:5]}, {}),
                (400, "box", {"box": ["a"] * 6}, {}), (400, "box", {"box": {"a": 1}}, {}), (400, "cylinder", {"cylinder": 1e9}, {}),
                (400, "half_size", {"box": self.BOX[:3] * 2}, {}), (400, "colour", {"box": self.BOX, "colour": 1}, {}),
                (400, "half_size", {"cylinder": [0, 0, 0, 1, -1]}, {}), (400, "free", {"box": self.BOX, "free": "yes"}, {}),
                (413, "request", " " * 5000, {})]:
            got, refused = clear(server, body, **more)
            self.assertEqual((got, refused.get("where")), (status, where), (body, more, refused))
        with server.half_open(b"POST /api/clear HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n\r\n") as line:
            self.assertIn(b" 411 ", line.recv(4096))
        self.assertEqual(server.ask("/api/info")[1]["revision"], revision)


class WhileMapping(unittest.TestCase):
    SCANS = 40

    def test_what_is_told_adds_up_and_the_map_is_the_same(self):
        with tempfile.TemporaryDirectory() as folder:
            growing = WaitingMap(folder, "spinning", "stairs", self.SCANS)
            with growing.served(self, "served") as server:
                stuck = [server.half_open(b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n") for _ in range(3)]
                stuck.append(serving.Live(server))
                self.follow(server)
                for line in stuck:
                    line.close()
            command("map", growing.folder / "scans", "-o", growing.folder / "alone", "--first", self.SCANS, "--resolution", "0.04")
            self.assertEqual(growing.saved("alone"), growing.saved("served"))

    def follow(self, server):
        """By events, and by asking for what has changed, until the map waits: then the two meet at one revision."""
        messages, live, asked, told_of, since, revision = 0, serving.Live(server), {}, {}, None, 0
        states = {}  # of each revision, by event or whole, whichever comes first: before the end they rarely meet
        status, page = server.ask("/")
        self.assertIn(status, (200, 400))  # 400: built without the page
        self.assertEqual(status == 200, b'name="octosurf-run"' in (page if status == 200 else b""))
        while since != self.SCANS:
            told = live.message()
            self.assertEqual(told["since"], since)  # an unknown `since` would be the whole map
            since, gone = told["map"]["revision"], told["changes"] or {"gone": [], "merged": []}
            self.take_over(told_of, gone, told["map"])
            changes = server.ask("/api/changes", since=revision)[1]
            self.take_over(asked, changes, changes["now"])
            revision = changes["revision"]
            whole = server.ask("/api/surfaces")[1]
            if whole["revision"] == revision:
                self.assertEqual([asked[i] for i in sorted(asked)], whole["surfaces"])
            by_event = [(i, told_of[i]["revision"]) for i in sorted(told_of)], told["map"].get("stairs", [])
            by_whole = [(s["id"], s["revision"]) for s in whole["surfaces"]], whole["stairs"]
            self.compare(states, since, "event", by_event)
            self.compare(states, whole["revision"], "whole", by_whole)
            messages += 1
            if messages % 3 == 1 and since != self.SCANS:  # comes back with what it knows
                live.close()
                live = serving.Live(server, f"?since={since}&run={told['run']}")
        self.assertEqual((since, revision, whole["revision"]), (self.SCANS,) * 3)
        self.assertGreater(messages, 1)  # some by way of a resync
        self.assertTrue(whole["stairs"])

    def compare(self, states, revision, way, state):
        ways = states.setdefault(revision, {})
        ways[way] = state
        self.assertEqual(ways.get("event", state), ways.get("whole", state))

    def take_over(self, known, changes, now):
        for gone in {*changes["gone"], *(successor["id"] for successor in changes["merged"])}:
            del known[gone]
        known.update((s["id"], s) for s in now["surfaces"])


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]], verbosity=2)
