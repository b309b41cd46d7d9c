"""`refdyn batch --slurm`: what it submits and prints, with a stub of Slurm; and with Slurm's own daemons, which the test starts, that
killed or requeued tasks change no bit of the result."""
import contextlib
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import tempfile
import time

import h5py
import pytest

from program import REFDYN, TESTS, refdyn

CASES, CHUNKS = 60, 4
SWEEP = """local rd = require "refdyn"
return rd.sweep { vary = { upper_theta = rd.grid(0.1, 1.5, 10), lower_theta = { -1, -0.6, -0.2, 0.2, 0.6, 1 } },
  t_end = %s, tol = 1e-10, keep = { extremes = { "E_x" } } }
"""
NEEDED = ["munged", "slurmctld", "slurmd", "sbatch", "squeue", "scontrol"]


def datasets(path):
    """All data except times: bytes or texts by name, and attributes of the file."""
    found = {}
    with h5py.File(path) as file:
        def visit(name, item):
            if isinstance(item, h5py.Dataset) and name != "cpu_s":
                found[name] = list(item.asstr()[()]) if item.dtype == object else (str(item.dtype), item.shape, item[()].tobytes())
        file.visititems(visit)
        found.update({f"@{name}": str(value) for name, value in file.attrs.items() if name != "command"})
    return found


def write_files(folder, t_end="0.2"):
    folder.mkdir(exist_ok=True)
    text = (TESTS / "models" / "double_pendulum.lua").read_text()
    option = """rd.option("label", "plain", { "plain", "it's" })"""
    (folder / "mo'del $x.lua").write_text(text.replace("return rd.model", f"{option}\nreturn rd.model"))
    (folder / "sweep.lua").write_text(SWEEP % t_end)
    return folder


def batch(folder, *arguments, output="runs.h5", model="mo'del $x.lua", env=None, status=0):
    return refdyn("batch", model, "sweep.lua", "-o", output, *arguments, cwd=folder, env=env, status=status)


# ---- Without Slurm ----


STUB = """#!/bin/sh
printf '%s\\n' "$@" "TMPDIR=$TMPDIR" > "$STUB/$(basename "$0")_$(ls "$STUB" | wc -l).txt"
cat "$STUB.say/$(basename "$0")" 2>/dev/null
[ ! -e "$STUB.say/$(basename "$0").fails" ] || { echo "it's refused" >&2; exit 1; }
"""


class Stub:
    """sbatch, squeue and scancel that record their arguments and print given texts."""

    def __init__(self, folder):
        self.calls, self.say = folder / "stub", folder / "stub.say"
        programs = folder / "programs"
        for path in (self.calls, self.say, programs):
            path.mkdir()
        for name in ("sbatch", "squeue", "scancel"):
            (programs / name).write_text(STUB)
            (programs / name).chmod(0o755)
        self.env = {"PATH": f"{programs}:{os.environ['PATH']}", "STUB": str(self.calls), "TMPDIR": str(folder)}
        self.answer("sbatch", "41")

    def answer(self, program, text, fails=False):
        (self.say / program).write_text(text + "\n")
        mark = self.say / f"{program}.fails"
        mark.touch() if fails else mark.unlink(missing_ok=True)

    def taken(self):
        """The calls since the last time: lists of words."""
        found = []
        for path in sorted(self.calls.iterdir(), key=lambda path: int(re.findall(r"\d+", path.stem)[-1])):
            found.append([re.sub("_.*", "", path.stem), *path.read_text().splitlines()])
            path.unlink()
        return found


@pytest.fixture()
def stub(tmp_path):
    return Stub(tmp_path)


@pytest.fixture()
def work(tmp_path):
    return write_files(tmp_path / "it's $HOME; here")


def run_script(folder, name, **env):
    return subprocess.run(["sh", folder / name], capture_output=True, text=True, env={**os.environ, **env}, cwd="/")


def run_chunks(slurm, chunks, stub):
    for chunk in chunks:
        done = run_script(slurm, "chunk.sh", SLURM_ARRAY_TASK_ID=str(chunk), SLURM_JOB_ID="7", **stub.env)
        assert done.returncode == 0, done.stderr


def test_submits_and_merges(work, stub, tmp_path):
    """The arguments of sbatch; the scripts, run by hand, produce the file of a local run."""
    said = batch(work, "--slurm", "--chunks", CHUNKS, "--slurm-options", "--partition=long  --time=1:00:00", "--threads", 2,
                 "--set", "label=it's", "--every", "0.05", env=stub.env).stderr
    slurm = work / "runs.h5.slurm"
    assert said.splitlines() == ["cases        60 in 4 chunks, 4 of these to compute", "jobs         41 (chunks), then 41 (merge)",
                                 "folder       runs.h5.slurm: scripts, and messages of the jobs", "watch        squeue -j 41,41"]
    common = ["sbatch", "--partition=long", "--time=1:00:00", "--parsable", f"--chdir={slurm}"]
    assert stub.taken() == [[*common, "--array=0-3", f"{slurm}/chunk.sh", f"TMPDIR={tmp_path}"],
                            [*common, "--dependency=afterany:41", f"{slurm}/merge.sh", f"TMPDIR={tmp_path}"]]
    header = (slurm / "chunk.sh").read_text().split("\nrefdyn=")[0]
    for line in ("array=0-3", "requeue", "open-mode=append", "output=chunk_%a.txt", "cpus-per-task=2"):
        assert f"\n#SBATCH --{line}\n" in header
    run_chunks(slurm, range(CHUNKS), stub)
    assert sorted(path.name for path in slurm.glob("part*")) == [f"part_{chunk}.h5" for chunk in range(CHUNKS)]
    assert run_script(slurm, "merge.sh").returncode == 0 and not list(slurm.glob("part*"))
    batch(work, "--set", "label=it's", "--every", "0.05", output="local.h5")
    assert datasets(work / "runs.h5") == datasets(work / "local.h5")
    again = run_script(slurm, "merge.sh")  # queued again after everything is done
    assert again.returncode == 0 and again.stderr == ""


def test_number_of_chunks(work, stub):
    assert "60 in 4 chunks" in batch(work, "--slurm", env=stub.env).stderr
    assert "7 in 1 chunk," in batch(work, "--slurm", "--cases", "3:10", output="a.h5", env=stub.env).stderr
    assert "7 in 7 chunks" in batch(work, "--slurm", "--cases", "3:10", "--chunks", 9, output="b.h5", env=stub.env).stderr
    for output in ("a.h5", "b.h5"):
        slurm = work / f"{output}.slurm"
        run_chunks(slurm, range(1 if output == "a.h5" else 7), stub)
        assert run_script(slurm, "merge.sh").returncode == 0
    assert datasets(work / "a.h5") == datasets(work / "b.h5")
    with h5py.File(work / "a.h5") as file:
        assert list(file["case"]) == list(range(3, 10))


def test_submits_what_is_missing(work, stub):
    batch(work, "--slurm", env=stub.env)
    slurm = work / "runs.h5.slurm"
    run_chunks(slurm, [1, 3], stub)
    done = run_script(slurm, "merge.sh")
    assert done.returncode == 1 and not (work / "runs.h5").exists()
    assert done.stderr.splitlines() == [
        "cases 0 to 14 are missing: chunk 0 has failed, see chunk_0.txt",
        "cases 30 to 44 are missing: chunk 2 has failed, see chunk_2.txt",
        f"{work}/runs.h5 is not written: 2 of 4 chunks are missing. The parts stay; calling refdyn batch --slurm again computes "
        "what is missing."]
    stub.taken()
    chunk = slurm / "chunk.sh"
    chunk.write_text(chunk.read_text() + "# edited\n")
    assert "60 in 4 chunks, 2 of these to compute" in batch(work, "--slurm", env=stub.env).stderr
    calls = stub.taken()
    assert [call[0] for call in calls] == ["squeue", "sbatch", "sbatch"]
    assert "--array=0,2" in calls[1] and chunk.read_text().endswith("# edited\n")
    run_chunks(slurm, [0, 2, 3], stub)  # chunk 3 is complete and does nothing
    stub.taken()
    said = batch(work, "--slurm", env=stub.env).stderr
    assert "0 of these to compute" in said and "jobs         41 (merge)" in said
    calls = stub.taken()
    assert [call[0] for call in calls] == ["squeue", "sbatch"] and "dependency" not in str(calls)
    assert run_script(slurm, "merge.sh").returncode == 0
    batch(work, output="local.h5")
    assert datasets(work / "runs.h5") == datasets(work / "local.h5")
    assert "runs.h5 already has all 60 cases" in batch(work, "--slurm", env=stub.env).stderr
    assert stub.taken() == []


def test_refused_while_it_runs(work, stub):
    batch(work, "--slurm", env=stub.env)
    for line in ("41", "7\n41\n41"):
        stub.answer("squeue", line)
        assert "its jobs are already in the queue: squeue -j 41,41" in batch(work, "--slurm", env=stub.env, status=1).stderr
    stub.answer("squeue", "", fails=True)
    said = batch(work, "--slurm", env=stub.env, status=1).stderr
    assert "squeue failed: it's refused" in said and "nothing was submitted" in said
    stub.answer("squeue", "7")
    batch(work, "--slurm", env=stub.env)


def test_changed_files(work, stub):
    """A task detects that its inputs differ from the submitted ones, and so does another submission."""
    batch(work, "--slurm", env=stub.env)
    with open(work / "sweep.lua", "a") as file:
        file.write("-- changed\n")
    slurm = work / "runs.h5.slurm"
    done = run_script(slurm, "chunk.sh", SLURM_ARRAY_TASK_ID="0", SLURM_RESTART_COUNT="3", SLURM_JOB_ID="7")
    assert done.returncode == 1 and "the cases of this batch differ from the journal's" in done.stderr
    assert "chunk 0, cases 0 to 14: exit status 1 after 3 retries" in done.stderr
    assert "the cases of this batch differ from those of the folder" in batch(work, "--slurm", env=stub.env, status=1).stderr
    (work / "sweep.lua").write_text(SWEEP % "0.2")
    for arguments, fact in ((["--chunks", 5], "another number of --chunks"), (["--cases", "0:30"], "another range of --cases"),
                            (["--set", "label=it's"], "the options of this batch differ from those of the folder")):
        assert fact in batch(work, "--slurm", *arguments, env=stub.env, status=1).stderr
    batch(work, "--slurm", "--chunks", 4, env=stub.env)


def test_failed_task_is_queued_again(work, stub):
    batch(work, "--slurm", env=stub.env)
    scontrol = pathlib.Path(stub.env["PATH"].split(":")[0]) / "scontrol"
    scontrol.write_text(STUB)
    scontrol.chmod(0o755)
    stub.taken()
    (work / "sweep.lua").unlink()
    for retries, calls in (("", 1), ("2", 1), ("3", 0)):
        done = run_script(work / "runs.h5.slurm", "chunk.sh", SLURM_ARRAY_TASK_ID="0", SLURM_JOB_ID="77", SLURM_RESTART_COUNT=retries,
                          **stub.env)
        assert done.returncode == 1
        assert [call[:3] for call in stub.taken()] == [["scontrol", "requeue", "77"]] * calls


@pytest.mark.quick
def test_refusals(work, stub, tmp_path):
    without = {"PATH": str(tmp_path / "none")}
    assert "sbatch of Slurm is not in PATH" in batch(work, "--slurm", env=without, status=1).stderr
    stub.answer("sbatch", "", fails=True)
    assert "sbatch failed: it's refused" in batch(work, "--slurm", env=stub.env, status=1).stderr
    stub.answer("sbatch", "Submitted batch job 12")
    assert "printed no job number" in batch(work, "--slurm", env=stub.env, status=1).stderr
    for arguments, fact in ((["--chunks", 5], "need --slurm"), (["--slurm-options", "-p x"], "need --slurm"),
                            (["--slurm", "--chunks", 1001], "at most 1000"), (["--slurm", "--summary", "s.json"], "write no summary"),
                            (["--slurm", "--slurm-options", "--array=1"], "refdyn sets --array itself"),
                            (["--slurm", "--cases", "0:61"], "has the cases 0 to 59")):
        assert fact in batch(work, *arguments, env=stub.env, status=2).stderr
    for output, fact in (("runs.csv", "must end in .h5"), ("a%b.h5", "must not have %")):
        assert fact in batch(work, "--slurm", output=output, env=stub.env, status=2).stderr
    (work / "sweep.lua").write_text("return {")
    assert "sweep.lua:1" in batch(work, "--slurm", output="c.h5", env=stub.env, status=1).stderr
    assert not (work / "c.h5.slurm").exists()


@pytest.mark.quick
def test_resume_of_what_is_complete(work):
    batch(work, "--cases", "0:9")
    before = os.stat(work / "runs.h5").st_mtime_ns
    said = batch(work, "--cases", "0:9", "--resume").stderr
    assert said == "refdyn: runs.h5 already has all 9 cases\n"
    said = batch(work, "--cases", "0:9", "--resume", "--set", "label=it's", status=1).stderr
    assert "runs.h5: belongs to another batch: the options differ" in said and "without --resume the file is replaced" in said
    assert os.stat(work / "runs.h5").st_mtime_ns == before
    batch(work, "--resume")
    with h5py.File(work / "runs.h5") as file:
        assert len(file["case"]) == CASES
    assert "has all 9 cases" in batch(work, "--cases", "0:9", "--resume").stderr


# ---- With Slurm ----


CONF = """ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=cred_expire=5,socket={folder}/munge.sock
CredType=cred/munge
SlurmctldPort={port}
SlurmdPort={node_port}
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
MailProg=/bin/true
ReturnToService=2
KillWait=2
SchedulerParameters=sched_interval=1,batch_sched_delay=0,sched_min_interval=0,bf_interval=1
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
JobCompType=jobcomp/none
SlurmdParameters=config_overrides
NodeName=localhost NodeHostname={host} NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=main Nodes=localhost Default=YES MaxTime=INFINITE State=UP
"""


def free_ports(count):
    """High ports without a listener."""
    sockets = [socket.socket() for _ in range(count)]
    for opened in sockets:
        opened.bind(("127.0.0.1", 0))
    ports = [opened.getsockname()[1] for opened in sockets]
    for opened in sockets:
        opened.close()
    return ports


def wait_for(what, condition, seconds=60):
    end = time.monotonic() + seconds
    while not (found := condition()):
        assert time.monotonic() < end, f"{what}: not within {seconds} s"
        time.sleep(0.05)
    return found


class Cluster:
    """munged, slurmctld and slurmd of one node, each in its own process group, in a separate folder."""

    def __init__(self, folder):
        self.folder, self.started = folder, []
        self.env = {**os.environ, "SLURM_CONF": str(folder / "slurm.conf"), "PATH": f"{os.environ['PATH']}:/usr/sbin:/sbin"}
        for name in ("state", "spool"):
            (folder / name).mkdir()
        port, node_port = free_ports(2)
        (folder / "slurm.conf").write_text(CONF.format(
            folder=folder, host=socket.gethostname().partition(".")[0], port=port, node_port=node_port,
            user=subprocess.check_output(["id", "-un"], text=True).strip()))
        # Slurm reads this file in spite of proctrack/linuxproc; of version 1 it needs only the name.
        (folder / "cgroup.conf").write_text("CgroupPlugin=cgroup/v1\n")
        (folder / "key").write_bytes(os.urandom(128))
        (folder / "key").chmod(0o400)

    def start(self, *command):
        log = open(self.folder / f"{command[0]}.out", "w")
        self.started.append(subprocess.Popen(command, env=self.env, stdin=subprocess.DEVNULL, stdout=log, stderr=log,
                                             cwd=self.folder, start_new_session=True))
        log.close()

    def call(self, *command):
        return subprocess.run(command, env=self.env, capture_output=True, text=True, timeout=60)

    def open(self):
        folder = self.folder
        self.start("munged", "--foreground", f"--socket={folder}/munge.sock", f"--key-file={folder}/key",
                   f"--pid-file={folder}/munged.pid", f"--log-file={folder}/munged.log", f"--seed-file={folder}/seed")
        wait_for("munged", (folder / "munge.sock").exists, 20)
        self.start("slurmctld", "-D", "-i")
        self.start("slurmd", "-D", "-N", "localhost")
        wait_for("a node that is idle", lambda: self.call("sinfo", "-h", "-o", "%T").stdout.strip() == "idle", 40)

    def close(self):
        """Cancels the jobs first, so that slurmd ends its children; then ends the groups of the daemons."""
        if len(self.started) == 3 and self.queue():
            self.call("scancel", *{line.split()[0] for line in self.queue()})
            with contextlib.suppress(AssertionError):
                wait_for("an empty queue", lambda: not self.queue(), 10)
        for process in reversed(self.started):
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGTERM)
        for process in reversed(self.started):
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()

    def queue(self):
        return self.call("squeue", "-h", "-o", "%F %K %T %A").stdout.splitlines()

    def logs(self):
        return "\n".join(f"{path.name}:\n{path.read_text(errors='replace')[-1500:]}" for path in self.folder.glob("*.[lo][ou][gt]"))


def missing_programs():
    path = f"{os.environ['PATH']}:/usr/sbin:/sbin"
    return [name for name in NEEDED if not shutil.which(name, path=path)]


@pytest.fixture(scope="module")
def cluster():
    if missing_programs():
        pytest.skip(f"not installed: {' '.join(missing_programs())}; Debian has them in slurmctld slurmd slurm-client munge")
    with tempfile.TemporaryDirectory(prefix="refdyn_slurm_") as name:
        folder = pathlib.Path(name)
        folder.chmod(0o711)  # munge needs a socket that everybody can reach; pytest's folders are private
        made = Cluster(folder)
        try:
            made.open()
            yield made
        except AssertionError as fact:
            raise AssertionError(f"{fact}\n{made.logs()}") from None
        finally:
            made.close()


def tasks_of(part):
    """Processes of refdyn that write this part."""
    found = []
    for path in pathlib.Path("/proc").glob("[0-9]*/cmdline"):
        with contextlib.suppress(OSError):
            words = path.read_bytes().split(b"\0")
            if words[0] == REFDYN.encode() and f"--output={part}".encode() in words:
                found.append(int(path.parent.name))
    return found


def size(path):
    return path.stat().st_size if path.exists() else 0


def test_killed_and_queued_again(cluster, tmp_path):
    """One task is killed and one is requeued while they compute: the file equals that of a local run to the bit."""
    work = write_files(tmp_path / "it's work", t_end="2000")  # some seconds for each chunk
    batch(work, "--threads", 2, output="local.h5")
    batch(work, "--slurm", "--chunks", CHUNKS, env=cluster.env)
    slurm = work / "runs.h5.slurm"
    assert "its jobs are already in the queue" in batch(work, "--slurm", env=cluster.env, status=1).stderr
    begun = size(slurm / "part_0.h5.journal")
    for chunk in (0, 1):
        wait_for(f"cases of chunk {chunk}", lambda: size(slurm / f"part_{chunk}.h5.journal") > begun)
    array = re.search(r"array (\d+)", (slurm / "submitted.txt").read_text())[1]
    os.kill(wait_for("a task", lambda: tasks_of(slurm / "part_0.h5"))[0], signal.SIGKILL)
    done = cluster.call("scontrol", "requeue", f"{array}_1")
    assert done.returncode == 0, done.stderr
    wait_for("the end of all jobs", lambda: not cluster.queue(), 120)
    said = {path.name: path.read_text() for path in slurm.glob("*.txt")}
    assert "exit status 137 after 0 retries" in said["chunk_0.txt"], said
    assert re.search("cases        15, ([1-9]|1[0-4]) of them computed now", said["chunk_0.txt"]), said
    assert (work / "runs.h5").exists() and not list(slurm.glob("part*")), said
    assert datasets(work / "runs.h5") == datasets(work / "local.h5")


def test_cancelled(cluster, tmp_path):
    """Cancelled jobs do not restart; the merge reports them, and completed cases remain."""
    work = write_files(tmp_path / "work", t_end="2000")
    batch(work, "--slurm", "--chunks", CHUNKS, env=cluster.env)
    slurm = work / "runs.h5.slurm"
    begun = size(slurm / "part_0.h5.journal")
    wait_for("cases of chunk 0", lambda: size(slurm / "part_0.h5.journal") > begun)
    array = re.search(r"array (\d+)", (slurm / "submitted.txt").read_text())[1]
    assert cluster.call("scancel", array).returncode == 0
    wait_for("the end of all jobs", lambda: not cluster.queue())
    assert "4 of 4 chunks are missing" in (slurm / "merge.txt").read_text()
    assert not tasks_of(slurm / "part_0.h5") and size(slurm / "part_0.h5.journal") > begun


def test_gaps_of_failed_tasks(cluster, tmp_path):
    """A task that always fails is tried four times; the merge names its cases, and another call computes them."""
    work = write_files(tmp_path / "work")
    batch(work, output="local.h5")
    slurm = work / "runs.h5.slurm"
    slurm.mkdir()
    (slurm / "part_2.h5.part").mkdir()  # no file can grow there
    batch(work, "--slurm", "--chunks", CHUNKS, env=cluster.env)
    wait_for("the end of all jobs", lambda: not cluster.queue(), 120)
    chunk, merge = (slurm / "chunk_2.txt").read_text(), (slurm / "merge.txt").read_text()
    assert [f"after {retries} retries" in chunk for retries in range(5)] == [True] * 4 + [False], chunk
    assert "cases 30 to 44 are missing: chunk 2 has failed" in merge and not (work / "runs.h5").exists(), merge
    assert sorted(path.name for path in slurm.glob("part_*.h5")) == ["part_0.h5", "part_1.h5", "part_3.h5"]
    (slurm / "part_2.h5.part").rmdir()
    assert "1 of these to compute" in batch(work, "--slurm", env=cluster.env).stderr
    wait_for("the end of all jobs", lambda: not cluster.queue(), 120)
    assert datasets(work / "runs.h5") == datasets(work / "local.h5")
