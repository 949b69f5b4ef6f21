#!/usr/bin/env python3
"""Tells Snakemake what became of a job of Slurm: running, success or failed. Without Slurm's accounting, which
small clusters do not have, only the controller knows."""
import re
import subprocess
import sys
import time

WAITS = ("PENDING", "CONFIGURING", "RUNNING", "COMPLETING", "SUSPENDED", "REQUEUED", "RESIZING", "STOPPED", "SIGNALING", "STAGE_OUT")
TRIES = 5  # a controller that restarts answers within some seconds


def main():
    for attempt in range(TRIES):
        asked = subprocess.run(["scontrol", "--oneliner", "show", "job", sys.argv[1]], capture_output=True, text=True)
        state = re.search(r"\bJobState=(\w+)", asked.stdout)
        if state:
            print("success" if state[1] == "COMPLETED" else "running" if state[1] in WAITS else "failed")
            return
        if "Invalid job id" in asked.stderr:
            break
        time.sleep(2 * attempt)
    print("failed")  # forgotten, or nobody answers: the job runs again, and writes the same


main()
