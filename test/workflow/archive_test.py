"""workflow/Snakefile maps parts side by side and merges them: by Slurm's own daemons on this machine, where a job that is
killed runs again, and without. Skipped, by what is missing, where Snakemake or Slurm are not installed.

archive_test.py OCTOSURF OCTOSURF_LAB AGREEMENT WORKFLOW_FOLDER"""

import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

OCTOSURF, LAB, AGREEMENT, WORKFLOW = (os.path.abspath(path) for path in sys.argv[1:5])
PARTS, SCANS, KILLED, SKIPPED = 8, 6, 5, 77
SBIN = os.pathsep + "/usr/sbin" + os.pathsep + "/sbin"


def require(*programs):
    for program in programs:
        if not shutil.which(program, path=os.environ["PATH"] + SBIN):
            print(f"skipped: {program} is not installed")
            sys.exit(SKIPPED)


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Slurm:
    """A controller and a node, of this user alone, in `folder`."""

    def __init__(self, folder):
        self.folder, self.daemons = folder, []
        self.environment = dict(os.environ, SLURM_CONF=f"{folder}/slurm.conf", PATH=os.environ["PATH"] + SBIN)
        user, host = subprocess.check_output(["id", "-un"], text=True).strip(), socket.gethostname().split(".")[0]
        for name in ("state", "spool"):
            os.mkdir(f"{folder}/{name}")
        with open(f"{folder}/slurm.conf", "w") as conf:
            conf.write(
                f"""ClusterName=archive
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={free_port()}
SlurmdPort={free_port()}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/none
CredType=cred/none
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
SwitchType=switch/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerParameters=sched_min_interval=0
SlurmdParameters=config_overrides
ReturnToService=2
NodeName={host} NodeAddr=127.0.0.1 CPUs=2 RealMemory=100000 State=UNKNOWN
PartitionName=all Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""
            )

    def __enter__(self):
        try:
            for command in (["slurmctld", "-D"], ["slurmd", "-D"]):
                log = open(f"{self.folder}/{command[0]}.out", "w")
                self.daemons.append(
                    subprocess.Popen(command, env=self.environment, stdout=log, stderr=log, start_new_session=True)
                )
            end = time.monotonic() + 60
            while "idle" not in subprocess.run(
                ["sinfo", "-h", "-o", "%T"], env=self.environment, capture_output=True, text=True
            ).stdout:
                if time.monotonic() > end or any(daemon.poll() is not None for daemon in self.daemons):
                    raise RuntimeError("Slurm did not start:\n" + self.logs())
                time.sleep(0.2)
        except BaseException:
            self.__exit__()
            raise
        return self

    def logs(self):
        text = ""
        for name in sorted(os.listdir(self.folder)):
            if name.endswith((".log", ".out")):
                text += f"--- {name}\n" + open(f"{self.folder}/{name}", errors="replace").read()[-3000:]
        return text

    def __exit__(self, *_):
        subprocess.run(["scancel", "--me", "--signal=KILL", "--full"], env=self.environment, capture_output=True)
        for daemon in reversed(self.daemons):
            daemon.terminate()
            try:
                daemon.wait(20)
            except subprocess.TimeoutExpired:
                daemon.kill()
                daemon.wait()


def run(command, **more):
    done = subprocess.run(command, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **more)
    assert done.returncode == 0, f"{command}\n{done.stdout}"
    return done.stdout


def workflow(folder, name, *options, octosurf=OCTOSURF):
    return (
        ["snakemake", "--snakefile", f"{WORKFLOW}/Snakefile", "--nolock", *options, "--config"]
        + ["inputs=room", f"map={name}", f"parts={PARTS}", f"scans={SCANS}", f"octosurf={octosurf}", "options=--resolution 0.05"],
        dict(cwd=folder, env=dict(os.environ, XDG_CACHE_HOME=f"{folder}/cache", HOME=folder)),
    )


def by_slurm(folder):
    marker, program = f"{folder}/begun", f"{folder}/octosurf"
    with open(program, "w") as file:  # the first run of one part waits to be killed
        file.write(
            f"""#!/bin/sh
case "$*" in *"--skip {(KILLED - 1) * SCANS} "*)
  [ -e {marker} ] || {{ echo $SLURM_JOB_ID > {marker}.new; mv {marker}.new {marker}; exec sleep 1000; }};;
esac
exec {OCTOSURF} "$@"
"""
        )
    os.chmod(program, 0o755)
    slurm_folder = f"{folder}/slurm"
    os.mkdir(slurm_folder)
    with Slurm(slurm_folder) as slurm:
        command, more = workflow(folder, "slurm_map", "--profile", f"{WORKFLOW}/profile/slurm", octosurf=program)
        more["env"].update(SLURM_CONF=slurm.environment["SLURM_CONF"], PATH=slurm.environment["PATH"])
        with open(f"{folder}/snakemake.log", "w") as log:
            running = subprocess.Popen(command, stdout=log, stderr=log, start_new_session=True, **more)
        try:
            while not os.path.exists(marker) and running.poll() is None:
                time.sleep(0.2)
            assert os.path.exists(marker), open(f"{folder}/snakemake.log").read() + slurm.logs()
            run(["scancel", "--signal=KILL", "--full", open(marker).read().strip()], env=slurm.environment)
            running.wait()
        finally:
            if running.poll() is None:
                os.killpg(running.pid, signal.SIGTERM)
        told = open(f"{folder}/snakemake.log").read()
        assert running.returncode == 0, told + slurm.logs()
        assert "Trying to restart job" in told, told


def main():
    require("snakemake", "slurmctld", "slurmd", "sbatch", "scontrol")
    with tempfile.TemporaryDirectory() as folder:
        run([LAB, "simulate", "room", "-o", "room", "--frames", str(PARTS * SCANS)], cwd=folder)
        run([OCTOSURF, "map", "room", "-o", "one", "--resolution", "0.05"], cwd=folder)
        command, more = workflow(folder, "local_map", "--cores", "2", "--quiet")
        run(command, **more)
        by_slurm(folder)
        for ending in ("surfaces", "bt", "json"):
            local, slurm = (open(f"{folder}/{name}_map.{ending}", "rb").read() for name in ("local", "slurm"))
            assert local == slurm, f"Slurm's map.{ending} differs"
        share = float(run([AGREEMENT, "one", "slurm_map"], cwd=folder))
        print(f"{PARTS} parts and one run agree in {100 * share:.2f} % of their area")
        assert share >= 0.99


main()
