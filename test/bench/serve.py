"""Measures `octosurf serve`: a steady rate of questions, then requests that are wrong in every way.

    test/bench/serve.py build/release/bin/octosurf maps/office --rate 200 --seconds 60 --fuzz 100000
"""

import argparse
import pathlib
import sys
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


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("command")
    parser.add_argument("map")
    parser.add_argument("--rate", type=int, default=200)
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--fuzz", type=int, default=100000)
    arguments = parser.parse_args()
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
