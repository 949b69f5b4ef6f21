"""Measures `octosurf serve`: a steady rate of questions, then requests that are wrong in every way.

    test/bench/serve.py build/release/bin/octosurf maps/office --rate 200 --seconds 60 --fuzz 100000

Or a mapper at 30 Hz, alone and followed by ten over WebSockets, one of them stuck, in turns:

    test/bench/serve.py build/release/bin/octosurf --follow ../shared/data/rgbd_7scenes_redkitchen --turns 3
"""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "apps"))
import serving  # noqa: E402


def memory_mb(server):
    for line in pathlib.Path(f"/proc/{server.process.pid}/status").read_text().splitlines():
        if line.startswith("VmRSS"):
            return int(line.split()[1]) / 1e3


def right_question(rng, surfaces):
    """A question as planners ask them, about a place on a surface. Plans, which take long, are not among them."""
    surface = rng.choice(surfaces)
    x, y, z = rng.choice(surface["boundary"])
    return rng.choice([
        ("/api/query/box", {"min": [x - 1, y - 1, z - 1], "max": [x + 1, y + 1, z + 1]}),
        ("/api/query/sphere", {"center": [x, y, z], "radius_m": 0.5}),
        ("/api/query/ray", {"from": [x, y, z + 1], "direction": [rng.gauss(0, 1), rng.gauss(0, 1), -0.5]}),
        ("/api/query/voxel", {"point": [x, y, z]}),
        ("/api/query/nearest", {"point": [x, y, z + 0.3]}),
        ("/api/query/foothold", {"point": [x, y, z], "yaw_deg": 30, "clearance_m": 0.2}),
        ("/api/regions", {"surface": surface["id"], "yaw_deg": rng.choice([0, 90]), "pieces": 4})])


def steady(server, rate, seconds, clients=8):
    surfaces = server.ask("/api/surfaces")[1]["surfaces"]
    waits, failures, late = [], [], []
    begin = time.monotonic() + 0.5

    def client(number):
        rng = __import__("random").Random(number)
        line = server.connection()
        for i in range(rate * seconds // clients):
            due = begin + (i * clients + number) / rate
            time.sleep(max(0, due - time.monotonic()))
            late.append(time.monotonic() - due)
            path, question = right_question(rng, surfaces)
            start = time.monotonic()
            try:
                status = server.ask(path, question, connection=line)[0]
            except OSError as failure:
                status, line = repr(failure), server.connection()
            waits.append(time.monotonic() - start)
            if status != 200:
                failures.append(status)

    threads = [threading.Thread(target=client, args=[n]) for n in range(clients)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    took = time.monotonic() - begin
    waits.sort()
    at = [1e3 * waits[int(len(waits) * share)] for share in (0.5, 0.99)] + [1e3 * waits[-1]]
    print(f"{len(waits)} questions in {took:.1f} s: {len(waits) / took:.0f}/s, {len(failures)} not answered "
          f"{failures[:5]}; ms p50 {at[0]:.2f}, p99 {at[1]:.2f}, max {at[2]:.1f}; "
          f"asked {1e3 * max(late):.0f} ms late at worst")


def follow(server, stuck, told):
    """As a page does that shows pending points: takes what comes, asks for voxels every two seconds."""
    live, asked = serving.Live(server), time.monotonic()
    try:
        if stuck:
            time.sleep(1000)
        while True:
            frame = live.frame()
            told["frames"] += 1
            told["bytes"] += len(frame[1])
            if frame[0] == 0x80 | serving.Live.PING:
                live.send(frame[1], serving.Live.PONG)
            if time.monotonic() > asked + 2:
                live.send("voxels")
                asked = time.monotonic()
    except OSError:
        pass  # the run is over


def mapped(command, scans, clients):
    """ms a scan took while so many followed; the first of them is stuck."""
    with tempfile.TemporaryDirectory() as folder:
        report, told = pathlib.Path(folder, "report.json"), {"frames": 0, "bytes": 0}
        words = ["-o", f"{folder}/map", "--realtime", "--rate", "30", "--report", str(report), "--checkpoint", "0"]
        if not clients:
            subprocess.run([command, "map", scans, *words], check=True, capture_output=True)
        else:
            server = serving.Server(command, scans, *words, verb="map", port="--serve")
            for number in range(clients):
                threading.Thread(target=follow, args=[server, number == 0, told], daemon=True).start()
            out, err = server.process.communicate(timeout=600)
            assert server.process.returncode == 0, (out, err)
        ms = json.loads(report.read_text())["scan_ms"]
    print(f"{clients:2} follow: a scan ms p50 {ms['p50']:.1f}, p95 {ms['p95']:.1f}, p99 {ms['p99']:.1f}, "
          f"max {ms['max']:.1f}; told {told['bytes'] / 1e6:.1f} MB", flush=True)
    return ms["p99"]


def followed(command, scans, turns):
    runs = [(mapped(command, scans, 0), mapped(command, scans, 10)) for _ in range(turns)]
    alone, with_ten = (sorted(column)[turns // 2] for column in zip(*runs))
    print(f"p99, median of {turns} turns: {alone:.1f} ms alone, {with_ten:.1f} ms followed: {with_ten / alone:.2f} times")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("command")
    parser.add_argument("map", nargs="?")
    parser.add_argument("--follow", metavar="SCANS")
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("--rate", type=int, default=200)
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--fuzz", type=int, default=100000)
    arguments = parser.parse_args()
    if arguments.follow:
        return followed(arguments.command, arguments.follow, arguments.turns)
    if not arguments.map:
        parser.error("a map is missing")
    with serving.Server(arguments.command, arguments.map) as server:
        if arguments.seconds:
            steady(server, arguments.rate, arguments.seconds)
        print(f"{memory_mb(server):.0f} MB")
        rng, begin = serving.world(), time.monotonic()
        statuses = serving.fuzz(server, rng, arguments.fuzz)
        print(f"{arguments.fuzz} odd requests in {time.monotonic() - begin:.0f} s: "
              f"{dict(sorted(statuses.items(), key=str))}; {memory_mb(server):.0f} MB")
        assert server.ask("/api/info")[0] == 200


if __name__ == "__main__":
    main()
