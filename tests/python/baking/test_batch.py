# SPDX-License-Identifier: MIT
"""Tests `risorius batch` with real worker processes, a Dask scheduler, and killed processes."""

import contextlib
import csv
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import batch_work
import numpy as np
import pytest
import risorius
from conftest import GOLDEN, PROJECT, no_room
from risorius.baking.progress import Progress, clock
from risorius.batch.cluster import Cluster
from risorius.batch.jobs import JobsError, read_jobs
from risorius.batch.journal import Journal
from risorius.batch.pool import Pool, PoolError
from risorius.batch.work import run_job, stamp
from risorius.cli import main
from risorius.files import fileio
from test_eval_clip import write_clip

RATE = 30
PACKAGES = [str(Path(risorius.__file__).parents[1]), str(PROJECT / "tests" / "python" / "support")]
FACES = ("core", "medium")


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(PACKAGES))


def curves_of(clip, count, frames):
    """Curves of clip number `clip` by formula, float32[count, frames] in 0 to 1."""
    t = np.arange(frames) / RATE
    return (0.5 + 0.5 * np.sin(np.outer(1 + np.arange(count) % 5, t) + clip)).astype(np.float32)


def make(folder, clips=3, frames=12, faces=FACES, table="", top='output = "out"\n'):
    """Write a folder with clips, faces and a jobs.toml. Returns the path of jobs.toml."""
    (folder / "clips").mkdir(parents=True)
    (folder / "faces").mkdir()
    names = risorius.load(GOLDEN / "core.dna").raw_control_names
    names += [n for n in risorius.load(GOLDEN / "medium.dna").raw_control_names if n not in names]
    for i in range(clips):
        write_clip(folder / "clips" / f"take{i}.csv", names, curves_of(i, len(names), frames), RATE)
    for face in faces:
        shutil.copy(GOLDEN / f"{face}.dna", folder / "faces")
    jobs = folder / "jobs.toml"
    table = table or 'write = "npz"\nlods = [0, 1]\nwhat = ["joints", "controls"]\n'
    jobs.write_text(f'{top}[[jobs]]\nclips = "clips/*.csv"\ncharacters = "faces/*.dna"\n{table}')
    return jobs


def check_outputs(jobs, clips=3, frames=12, faces=FACES, lods=(0, 1)):
    """Check that all outputs exist and are complete, and that frames equal Rig.evaluate."""
    names = risorius.load(GOLDEN / "core.dna").raw_control_names
    names += [n for n in risorius.load(GOLDEN / "medium.dna").raw_control_names if n not in names]
    out = jobs.parent / "out"
    assert not list(out.rglob("*.part"))
    assert len(list(out.rglob("*.npz"))) == clips * len(faces) * len(lods)
    for face in faces:
        rig = risorius.Rig(risorius.load(GOLDEN / f"{face}.dna"))
        columns = [names.index(n) for n in rig.raw_control_names]
        for i in range(clips):
            raw = curves_of(i, len(names), frames)[columns].T
            for lod in lods:
                with np.load(out / face / f"lod{lod}" / f"take{i}.npz") as arrays:
                    joints = np.stack([rig.evaluate(row, lod=lod).joints for row in raw])
                    np.testing.assert_array_equal(arrays["joints"], joints)
                    np.testing.assert_array_equal(arrays["controls"][:, : len(columns)], raw)


def table_of(jobs):
    return list(csv.DictReader((jobs.parent / "out" / "summary.csv").open()))


def files_of(jobs):
    return {p: p.stat().st_mtime_ns for p in (jobs.parent / "out").rglob("*.npz")}


# ---- outputs


def test_every_job_is_done_and_the_summary_says_so(tmp_path, capsys):
    jobs = make(tmp_path / "a folder")
    assert main(["batch", str(jobs), "--workers", "2"]) == 0
    check_outputs(jobs)
    rows = table_of(jobs)
    assert [row["job"] for row in rows] == [
        f"{face}/lod{lod}/take{i}" for face in FACES for i in range(3) for lod in (0, 1)
    ]
    assert {row["state"] for row in rows} == {"done"}
    assert {row["frames"] for row in rows} == {"12"}
    text = (PROJECT / "docs" / "batch.md").read_text(encoding="utf-8")
    assert list(rows[0]) == re.search("The summary's columns: `(.+?)`", text).group(1).split()
    folder = jobs.parent
    assert (rows[0]["clip"], rows[0]["character"], rows[0]["error"], rows[0]["mapping"]) == (
        str(folder / "clips" / "take0.csv"), str(folder / "faces" / "core.dna"), "", "controls"
    )  # fmt: skip
    assert "12 jobs: 12 done; 144 frames" in capsys.readouterr().out


def test_statistics_alone(tmp_path, capsys):
    jobs = make(tmp_path / "j", clips=1, faces=["medium"], table="rate = 15\nframes = [1, 4]\n")
    names = risorius.load(GOLDEN / "medium.dna").raw_control_names
    curves = curves_of(0, len(names), 12)
    curves[2] *= 3
    write_clip(jobs.parent / "clips" / "take0.csv", ["other", *names[1:]], curves, RATE)
    assert main(["batch", str(jobs), "--json", "--workers", "1"]) == 0
    assert json.loads(capsys.readouterr().out)["frames"] == 3
    (job,) = json.loads((jobs.parent / "out" / "summary.json").read_text())["jobs"]
    rig = risorius.Rig(risorius.load(GOLDEN / "medium.dna"))
    raw = curves[:, [2, 4, 6]].T.copy()  # every second frame at 30 frames per second
    raw[:, 0] = 0
    poses = [rig.evaluate(row) for row in raw]
    moves = np.linalg.norm(np.stack([p.joints for p in poses])[:, :, :3].astype(float), axis=2)
    frame, joint = np.unravel_index(moves.argmax(), moves.shape)
    psds = slice(len(names), len(names) + risorius.load(GOLDEN / "medium.dna").psd_count)
    assert job["largest_move"] == pytest.approx(moves.max(), rel=1e-6)
    assert (job["largest_move_frame"], job["lod"]) == (frame, 0)
    assert job["largest_move_joint"] == risorius.load(GOLDEN / "medium.dna").joint_names[joint]
    fired = np.stack([p.controls for p in poses])[:, psds].any(axis=0)
    assert fired.sum() > 0
    assert job["correctives_fired"] == fired.sum()
    assert job["unmapped_curves"] == ["other"]
    assert job["out_of_range"] == [names[2]]
    assert job["control_ranges"][names[2]] == [raw[:, 2].min(), raw[:, 2].max()]
    assert job["evaluation_seconds"] > 0
    assert not [p for p in (jobs.parent / "out").rglob("*") if p.suffix in (".npz", ".part")]
    assert main(["batch", str(jobs), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["kept"] == 1


def test_all_kinds_of_options_in_one_file(tmp_path):
    jobs = make(tmp_path / "j", clips=1, faces=["core"], table='write = ["csv", "npz"]\n')
    with jobs.open("a") as file:
        file.write(
            '[[jobs]]\nclips = "clips/take0.csv"\ncharacters = "faces/core.dna"\nwrite = "npz"\n'
            'name = "turns/{clip}_{character}_{lod}"\nquaternions = true\ncompress = true\n'
        )
    assert main(["batch", str(jobs), "--workers", "1"]) == 0
    out = jobs.parent / "out"
    with np.load(out / "turns" / "take0_core_0.npz") as arrays:
        assert arrays["joints"].shape == (12, 5, 10)
        assert "controls" not in arrays
    lines = (out / "core" / "lod0" / "take0.csv").read_text().splitlines()
    assert len(lines) == 13
    assert lines[0].startswith("time,joint:")


def test_clips_are_mapped_and_resampled_to_clips(tmp_path, monkeypatch):
    own = 'name = "own"\n[rows]\nJawOpen = { "CTRL_expressions.jawOpen" = 0.5 }\n'
    table = 'write = "rzc"\nrate = 60\nmapping = "own.toml"\n'
    jobs = make(tmp_path / "j", clips=1, faces=["core"], table=table)
    write_clip(tmp_path / "j" / "clips" / "take0.csv", ["JawOpen"], [[0, 0.5, 1]], RATE)
    (tmp_path / "j" / "own.toml").write_text(own)
    assert main(["batch", str(jobs), "--workers", "1"]) == 0
    clip = risorius.Clip.load(jobs.parent / "out" / "core" / "lod0" / "take0.rzc")
    assert clip.rate == 60
    assert table_of(jobs)[0]["mapping"] == "own"
    np.testing.assert_array_equal(
        clip.curve("CTRL_expressions.jawOpen"), np.float32([0, 0.125, 0.25, 0.375, 0.5])
    )
    plan = read_jobs(jobs)
    before = stamp(plan.jobs[0])
    (tmp_path / "j" / "own.toml").write_text(own.replace("0.5", "0.25"))
    after = stamp(plan.jobs[0])
    assert after != before  # another mapping gives another output
    monkeypatch.setattr("risorius.batch.work.compile_version", lambda: 1)
    assert stamp(plan.jobs[0]) != after  # and so does another compiler version


# ---- finished jobs are skipped, others run again


def test_only_what_changed_is_done_again(tmp_path, capsys):
    jobs = make(tmp_path / "j")
    run = ["batch", str(jobs), "--workers", "1"]
    assert main(run) == 0
    first = files_of(jobs)
    assert main(["batch", str(jobs), "--dry-run"]) == 0
    assert "12 jobs, 0 to do" in capsys.readouterr().out
    out = jobs.parent / "out"
    (out / "core" / "lod0" / "take1.npz").unlink()  # one output is deleted,
    with open(out / "core" / "lod1" / "take1.npz", "r+b") as file:  # one is truncated,
        file.truncate(100)
    clip = jobs.parent / "clips" / "take2.csv"  # and one clip has changed
    clip.write_text(clip.read_text().replace("0.5", "0.25"))
    assert main([*run, "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert (facts["done"], facts["kept"]) == (2 + 4, 6)
    changed = {p.relative_to(out).as_posix() for p, t in files_of(jobs).items() if first[p] != t}
    assert changed == {
        "core/lod0/take1.npz", "core/lod1/take1.npz",
        *(f"{face}/lod{lod}/take2.npz" for face in FACES for lod in (0, 1)),
    }  # fmt: skip
    jobs.write_text(jobs.read_text().replace('"joints", ', '"joints", "maps", '))
    assert main(["batch", str(jobs), "--dry-run"]) == 0
    assert "12 jobs, 12 to do" in capsys.readouterr().out


def test_restart_does_everything_again(tmp_path, capsys):
    jobs = make(tmp_path / "j", clips=1, faces=["core"])
    assert main(["batch", str(jobs), "--workers", "1"]) == 0
    first = files_of(jobs)
    assert main(["batch", str(jobs), "--workers", "1", "--restart"]) == 0
    assert "2 jobs: 2 done" in capsys.readouterr().out
    assert not set(first.items()) & set(files_of(jobs).items())


def test_a_journal_that_is_cut_or_is_none_is_no_trouble(tmp_path, capsys):
    jobs = make(tmp_path / "j", clips=2, faces=["core"])
    assert main(["batch", str(jobs), "--workers", "1"]) == 0
    journal = jobs.parent / "out" / ".jobs.journal"
    data = journal.read_bytes()
    for bad, kept in (
        (data, 4), (data[:-20], 3), (b"", 0), (b"\0\xff\n[]\n1\n", 0), (b"{}\n" + data, 0),
        (data.replace(b'"stamp": "', b'"stamp": "0'), 0),
        (data.replace(b'"files": [', b'"f": ['), 0),
    ):  # fmt: skip
        journal.write_bytes(bad)
        capsys.readouterr()
        assert main(["batch", str(jobs), "--dry-run"]) == 0
        assert f"4 jobs, {4 - kept} to do" in capsys.readouterr().out


def start(jobs, *options):
    """Start the command as a shell does, in a process group of its own."""
    command = [sys.executable, "-m", "risorius", "batch", str(jobs), "--workers", "2", *options]
    return subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, start_new_session=True
    )


def wait_for_outputs(jobs, process):
    """Wait until two jobs are done; the batch must not have ended."""
    journal = jobs.parent / "out" / ".jobs.journal"
    while not journal.exists() or journal.read_bytes().count(b"\n") < 3:
        assert process.poll() is None, "the batch has ended already"
        time.sleep(0.002)


@pytest.mark.parametrize("how", ["interrupt", "kill"])
def test_interrupted_goes_on_where_it_was(tmp_path, how, capsys):
    jobs = make(tmp_path / "j", clips=8, frames=1500, table='write = ["npz", "csv"]\n')
    process = start(jobs)
    wait_for_outputs(jobs, process)
    # Ctrl-C in a terminal reaches every process of the group; SIGKILL simulates a machine that
    # fails.
    os.killpg(process.pid, signal.SIGINT if how == "interrupt" else signal.SIGKILL)
    error = process.communicate()[1].decode()
    out = jobs.parent / "out"
    if how != "kill":
        assert process.returncode == 130, error
        assert "the same command goes on" in error
        assert "Traceback" not in error
        assert not list(out.rglob("*.part"))
        states = [row["state"] for row in table_of(jobs)]
        assert states.count("not done") == 16 - states.count("done")
    for path in out.rglob("take*.npz"):  # complete or missing
        with np.load(path) as arrays:
            assert len(arrays["joints"]) == 1500
    first = files_of(jobs)
    assert main(["batch", str(jobs), "--workers", "2", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert 0 < facts["kept"] < 16
    assert facts["done"] == 16 - facts["kept"]
    again = [p for p, t in files_of(jobs).items() if first.get(p, t) != t]
    assert len(again) <= 2  # one per worker was not in the journal
    assert len(files_of(jobs)) == 16
    assert not list(out.rglob("*.part"))


def test_what_killed_workers_left_goes_where_all_jobs_are_done_too(tmp_path):
    jobs = make(tmp_path / "j", clips=1, faces=["core"])
    assert main(["batch", str(jobs), "--workers", "1"]) == 0
    code = (
        "import os, sys; from risorius.files import fileio\n"
        "with fileio.replacing(sys.argv[1]): os.kill(os.getpid(), 9)"
    )
    folder = jobs.parent / "out" / "core" / "lod1"
    subprocess.run([sys.executable, "-c", code, str(folder / "take0.npz")], check=False)
    assert len(list(folder.glob(".risorius-*.part"))) == 1
    assert main(["batch", str(jobs), "--workers", "1"]) == 0
    assert os.listdir(folder) == ["take0.npz"]


def test_a_second_batch_in_a_folder_is_told_who_works_there(tmp_path):
    jobs = make(tmp_path / "j", clips=4, frames=1500)
    first = start(jobs)
    wait_for_outputs(jobs, first)
    if os.name != "nt":
        first.send_signal(signal.SIGSTOP)  # it must not end before the second starts
    second = start(jobs)
    error = second.communicate()[1].decode()
    if os.name != "nt":
        first.send_signal(signal.SIGCONT)
    assert second.returncode == 1
    assert len(error.splitlines()) == 1
    assert f"out: process {first.pid} on {socket.gethostname()}, since " in error
    assert first.wait() == 0, first.communicate()[1]
    check_outputs(jobs, clips=4, frames=1500)
    assert [row["state"] for row in table_of(jobs)] == ["done"] * 16
    assert not (jobs.parent / "out" / ".risorius.lock").exists()


def test_a_journal_that_somebody_changes_is_a_sentence(tmp_path):
    plan = read_jobs(make(tmp_path / "j", clips=1, faces=["core"]))
    journal = Journal(plan.journal)
    journal.begin([])
    journal.add(plan.jobs[0], run_job(plan.jobs[0]))
    plan.journal.write_bytes(b"something else")
    with pytest.raises(JobsError, match=r"\.jobs\.journal: somebody else has changed it"):
        journal.facts(plan.jobs[0].name)


@pytest.mark.skipif(os.name == "nt", reason="limits are those of POSIX")
def test_a_journal_without_room_says_its_name_and_stays_as_it_was(tmp_path):
    plan = read_jobs(make(tmp_path / "j", clips=2, faces=["core"], table='write = "npz"\n'))
    journal, outcomes = Journal(plan.journal), [run_job(job) for job in plan.jobs]
    journal.begin([])
    journal.add(plan.jobs[0], outcomes[0])
    before = plan.journal.read_bytes()
    with no_room(len(before) + 20), pytest.raises(OSError, match=r"\.jobs\.journal"):
        journal.add(plan.jobs[1], outcomes[1])
    assert plan.journal.read_bytes() == before
    journal.add(plan.jobs[1], outcomes[1])
    again = Journal(plan.journal)
    again.read()
    assert [again.is_done(job) for job in plan.jobs] == [True, True]
    assert again.facts(plan.jobs[1].name) == json.loads(json.dumps(outcomes[1].facts))


def test_a_folder_that_cannot_be_is_said_before_any_job(tmp_path, capsys):
    jobs = make(tmp_path / "j", clips=1)
    (jobs.parent / "out").write_text("a file")
    assert main(["batch", str(jobs)]) == 1
    error = capsys.readouterr().err
    assert len(error.splitlines()) == 1
    assert "summary.csv: a file stands where its folder should be" in error
    assert not (tmp_path / "cache").exists()


# ---- death of workers


def test_a_killed_worker_costs_an_attempt_only(tmp_path):
    jobs = make(tmp_path / "j", clips=5)
    plan, outcomes = read_jobs(jobs), []
    pool = Pool(batch_work.slow, 2)
    for outcome in pool.results(plan.jobs):
        outcomes.append(outcome)
        if len(outcomes) == 3:
            os.kill(pool._workers[0].process.pid, signal.SIGKILL)
    assert {o.name for o in outcomes} == {job.name for job in plan.jobs}
    assert [o.error for o in outcomes] == [""] * 20
    assert max(o.attempts for o in outcomes) <= 2
    fileio.sweep({path.parent for job in plan.jobs for _, path in job.outputs})
    check_outputs(jobs, clips=5)


def test_a_job_that_ends_its_worker_once_is_done_by_another(tmp_path, monkeypatch):
    jobs = make(tmp_path / "j", clips=3)
    (tmp_path / "j" / "clips" / "take2.csv").rename(tmp_path / "j" / "clips" / "deadly.csv")
    monkeypatch.setattr("risorius.batch.running.run_job", batch_work.deadly_once)
    assert main(["batch", str(jobs), "--workers", "2"]) == 0
    attempts = {row["job"]: row["attempts"] for row in table_of(jobs)}
    assert sorted(attempts.values()) == ["1"] * 11 + ["2"]
    assert max(attempts, key=attempts.get).endswith("deadly")
    for path in (jobs.parent / "out").rglob("deadly.npz"):
        path.rename(path.with_name("take2.npz"))
    check_outputs(jobs)


def test_a_job_beside_one_that_ends_its_workers_is_not_blamed(tmp_path):
    jobs = make(tmp_path / "j", clips=2, faces=["core"])
    (tmp_path / "j" / "clips" / "take1.csv").rename(tmp_path / "j" / "clips" / "deadly.csv")
    both = [job for job in read_jobs(jobs).jobs if job.lod == 0]
    assert sorted(job.clip.stem for job in both) == ["deadly", "take0"]
    done = {o.name.rpartition("/")[2]: o for o in Pool(batch_work.beside_deadly, 2).results(both)}
    assert (done["take0"].error, done["take0"].attempts) == ("", 1)
    assert done["deadly"].error == "given up: it has ended 3 workers (signal 9)"


def test_a_job_that_ends_every_worker_is_named_and_given_up(tmp_path, monkeypatch, capsys):
    jobs = make(tmp_path / "j", clips=3, faces=["core"])
    (tmp_path / "j" / "clips" / "take2.csv").rename(tmp_path / "j" / "clips" / "deadly.csv")
    monkeypatch.setattr("risorius.batch.running.run_job", batch_work.deadly)
    assert main(["batch", str(jobs), "--workers", "2"]) == 1
    error = capsys.readouterr().err
    assert "core/lod0/deadly: given up: it has ended 3 workers (signal 9)" in error
    assert "core/lod1/deadly: given up: it has ended 3 workers (signal 9)" in error
    check_outputs(jobs, clips=2, faces=["core"])


def test_a_fault_of_a_job_does_not_end_its_worker(tmp_path):
    plan = read_jobs(make(tmp_path / "j", clips=2, faces=["core"]))
    errors = [o.error for o in Pool(batch_work.faulty, 1).results(plan.jobs)]
    assert sorted(errors) == ["KeyError: 'take0'"] * 2 + ["KeyError: 'take1'"] * 2


def test_workers_that_cannot_start_are_no_endless_loop(tmp_path):
    plan = read_jobs(make(tmp_path / "j", clips=1, faces=["core"]))
    with pytest.raises(PoolError, match="before they have begun"):
        list(Pool(Unloadable(), 1).results(plan.jobs))


class Unloadable:
    """Work that fails when a worker process unpickles it."""

    def __reduce__(self):
        return (int, ("no number",))


def test_failed_jobs_are_named_and_the_others_done(tmp_path, capsys):
    jobs = make(tmp_path / "j", clips=2, table='lods = [0, 2]\nwrite = "npz"\n')
    (tmp_path / "j" / "clips" / "take1.csv").write_text("time,a\n0,x\n")
    (tmp_path / "j" / "faces" / "bad.dna").write_text("no face")
    assert main(["batch", str(jobs), "--workers", "2"]) == 1
    output = capsys.readouterr()
    assert "12 jobs: 3 done, 9 failed" in output.out
    listed = output.err[output.err.index("9 of 12 jobs failed:") :].splitlines()[1:]
    assert [line.split(":")[0].strip() for line in listed] == [
        "bad/lod0/take0", "bad/lod2/take0", "bad/lod0/take1", "bad/lod2/take1", "core/lod2/take0",
        "core/lod0/take1", "core/lod2/take1", "medium/lod0/take1", "medium/lod2/take1",
    ]  # fmt: skip
    assert "bad.dna" in listed[0]
    assert "core: a LOD from 0 to 1 was expected, found 2" in listed[4]
    assert "take1.csv" in listed[7]
    rows = {row["job"]: row for row in table_of(jobs)}
    assert rows["core/lod2/take0"]["state"] == "failed"
    assert "found 2" in rows["core/lod2/take0"]["error"]


# ---- a Dask cluster


class Dask:
    """A Dask scheduler and two workers, as processes of this machine."""

    def __init__(self, folder):
        self.folder = folder
        self.processes = []

    def __enter__(self):
        file = self.folder / "scheduler.json"
        self.run("scheduler", "--port", "0", "--scheduler-file", str(file))
        for _ in range(2):
            self.run("worker", "--no-nanny", "--nthreads", "1", "--scheduler-file", str(file))
        while not file.exists() or not file.read_text().endswith("}"):
            assert self.processes[0].poll() is None
            time.sleep(0.02)
        self.address = json.loads(file.read_text())["address"]
        return self

    def run(self, what, *options):
        command = [sys.executable, "-m", f"distributed.cli.dask_{what}", "--no-dashboard"]
        environment = os.environ | {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0"}
        self.processes.append(
            subprocess.Popen(
                [*command, "--host", "127.0.0.1", *options],
                cwd=self.folder, env=environment, stderr=subprocess.DEVNULL,
            )
        )  # fmt: skip

    def __exit__(self, *error):
        for process in self.processes:
            process.kill()
            process.wait()


def lose_the_first(cluster, monkeypatch):
    """Let the first result be lost together with its worker, so that its job runs again."""
    distributed = pytest.importorskip("distributed")
    lost = []

    class AsCompleted(distributed.as_completed):
        def __next__(self):
            future = super().__next__()
            if not lost:
                lost.append(future.key)
                cluster._client._handle_lost_data(key=future.key)
                assert future.status == "lost"
                again = cluster._client._handle_key_in_memory
                cluster._client.loop.call_later(0.3, again, key=future.key)
            return future

    monkeypatch.setattr(distributed, "as_completed", AsCompleted)
    return lost


def test_dask_with_a_worker_killed_in_the_middle(tmp_path, capsys, monkeypatch):
    version = risorius.__version__
    monkeypatch.setattr("risorius.batch.cluster._CONNECT_SECONDS", 30.0)  # for a busy machine
    jobs = make(tmp_path / "j", clips=5)
    plan, outcomes = read_jobs(jobs), []
    with Dask(tmp_path) as dask:
        cluster = Cluster(dask.address, batch_work.slow)
        with contextlib.suppress(TimeoutError):
            cluster._client.wait_for_workers(2, timeout=600)
        assert len(cluster.workers()) == 2
        lost = lose_the_first(cluster, monkeypatch)
        for outcome in cluster.results(plan.jobs):
            outcomes.append(outcome)
            if len(outcomes) == 4:
                dask.processes[1].kill()
                dask.processes[1].wait()
        assert len(lost) == 1
        assert sorted(o.name for o in outcomes) == sorted(job.name for job in plan.jobs)
        assert [o.error for o in outcomes] == [""] * 20
        fileio.sweep({path.parent for job in plan.jobs for _, path in job.outputs})
        check_outputs(jobs, clips=5)
        shutil.rmtree(jobs.parent / "out")  # the other worker makes it again
        assert main(["batch", str(jobs), "--scheduler", dask.address, "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["done"] == 20
        check_outputs(jobs, clips=5)
        monkeypatch.setattr(risorius, "__version__", "9.9")
        assert main(["batch", str(jobs), "--scheduler", dask.address, "--restart"]) == 1
        wanted = f"core/lod0/take0: a worker with risorius 9.9 was expected, found {version}"
        assert wanted in capsys.readouterr().err
        monkeypatch.setattr(risorius, "__version__", version)
        dask.processes[0].kill()
        dask.processes[0].wait()
        monkeypatch.setattr("risorius.batch.cluster._CONNECT_SECONDS", 2.0)
        assert main(["batch", str(jobs), "--scheduler", dask.address]) == 1
        assert "no Dask scheduler answers there" in capsys.readouterr().err


def test_nobody_at_the_address(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("risorius.batch.cluster._CONNECT_SECONDS", 0.2)
    jobs = make(tmp_path / "j", clips=1, faces=["core"])
    for address in ("nowhere", "tcp://127.0.0.1:9"):
        assert main(["batch", str(jobs), "--scheduler", address]) == 1
        assert f"{address}: no Dask scheduler answers there" in capsys.readouterr().err


# ---- JOBS.toml


def test_the_list_of_jobs_is_the_same_each_time(tmp_path, monkeypatch):
    jobs = make(tmp_path / "j", clips=4)
    plan = read_jobs(jobs)
    monkeypatch.chdir(jobs.parent)
    assert [j.name for j in read_jobs(Path("jobs.toml")).jobs] == [j.name for j in plan.jobs]
    assert {path.is_absolute() for job in plan.jobs for _, path in job.outputs} == {True}


def test_folders_of_clips_may_be_part_of_the_name(tmp_path):
    jobs = make(tmp_path / "j", clips=1, faces=["core"])
    for folder in ("a", "b/c"):
        (tmp_path / "j" / "clips" / folder).mkdir(parents=True)
        shutil.copy(tmp_path / "j" / "clips" / "take0.csv", tmp_path / "j" / "clips" / folder)
    jobs.write_text(jobs.read_text().replace("clips/*.csv", "clips/**/*.csv"))
    assert [j.name for j in read_jobs(jobs).jobs if j.lod == 0] == [
        "core/lod0/a/take0", "core/lod0/b/c/take0", "core/lod0/take0",
    ]  # fmt: skip


GOOD = 'output = "out"\n[[jobs]]\nclips = "clips/*.csv"\ncharacters = "faces/*.dna"\n'


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("output = ", "not TOML"),
        ("\x00", "not TOML"),
        ("a = " + "[" * 100000, "not TOML"),
        (b"output = '\xff'", "not TOML"),
        ("", "output: a folder was expected, found nothing"),
        ('output = "out"', "jobs: one or more tables [[jobs]] was expected, found nothing"),
        ('output = "out"\njobs = []', "jobs: one or more tables"),
        ('output = "out"\njobs = [3]', "jobs: one or more tables"),
        ("output = 3\n" + GOOD[15:], "output: a folder was expected, found 3"),
        ('worker = 2\n' + GOOD, "worker: one of the keys output, summary, jobs was expected"),
        ('summary = "s.txt"\n' + GOOD, "summary: names ending in .csv or .json"),
        ('summary = "../s.csv"\n' + GOOD, "summary: a name inside the output folder"),
        ('summary = ["a.csv", "A.csv"]\n' + GOOD, "summary: different files"),
        (GOOD + "lod = [0]", "jobs[0].lod: one of the keys clips, characters"),
        (GOOD + "lods = 0", "jobs[0].lods: a list of LODs (0 is the finest) was expected, found 0"),
        (GOOD + "lods = []", "jobs[0].lods"),
        (GOOD + "lods = [true]", "jobs[0].lods"),
        (GOOD + "lods = [-1]", "jobs[0].lods"),
        (GOOD + "lods = [0, 0]", "jobs[0].lods: each LOD once was expected"),
        (GOOD + 'write = "exe"', "jobs[0].write: some of npz, csv, rzc were expected, found 'exe'"),
        (GOOD + 'write = ["npz", "npz"]', "jobs[0].write: each once was expected"),
        (GOOD + "write = 1", "jobs[0].write: a string or a list of strings was expected, found 1"),
        (GOOD + "what = []", "jobs[0].what"),
        (GOOD + 'what = ["bones"]', "jobs[0].what: some of joints, shapes, maps, controls"),
        (GOOD + "rate = 0", "jobs[0].rate: frames per second above 0 was expected, found 0"),
        (GOOD + "rate = nan", "jobs[0].rate"),
        (GOOD + "rate = true", "jobs[0].rate"),
        (GOOD + 'rate = "30"', "jobs[0].rate"),
        (GOOD + "frames = [3, 3]", "jobs[0].frames: [first, end] with first below end"),
        (GOOD + "frames = [0, 99999999999999999999]", "jobs[0].frames"),
        (GOOD + "quaternions = 1", "jobs[0].quaternions: true or false was expected, found 1"),
        (GOOD + "mapping = 3", "jobs[0].mapping: a mapping was expected, found 3"),
        (GOOD + 'mapping = "no.toml"', "no.toml: cannot read it"),
        (GOOD + 'mapping = "clips/take0.csv"', "jobs[0].mapping:"),
        (GOOD + 'name = "{clip.__class__}"', "jobs[0].name: a pattern of {clip}, {character}"),
        (GOOD + 'name = "{clip!r}"', "jobs[0].name"),
        (GOOD + 'name = "{lod:99999999999}"', "jobs[0].name"),
        (GOOD + 'name = "{clip"', "jobs[0].name"),
        (GOOD + 'name = "{}"', "jobs[0].name"),
        (GOOD + 'name = ""', "jobs[0].name: a pattern was expected, found ''"),
        (GOOD + 'name = "../{clip}"', "jobs[0].name: a name inside the output folder"),
        (GOOD + 'name = "..\\\\..\\\\{clip}"', "jobs[0].name: a name inside the output folder"),
        (GOOD + 'name = "/tmp/{clip}"', "jobs[0].name: a name inside the output folder"),
        (GOOD + 'name = "nul/{clip}"', "names of files as every system takes them"),
        (GOOD + 'name = "C:{clip}"', "of 200 bytes at most, were expected, found 'C:take0'"),
        ('summary = "com1.csv"\n' + GOOD, "summary: names of files as every system takes them"),
        (GOOD + 'name = "{folder}"', "jobs[0].name: a name inside the output folder"),
        (GOOD + 'name = "one"\nwrite = "npz"', "take0.csv on core.dna at LOD 0"),
        (GOOD + 'name = "one"', "name: a file of its own was expected for each job"),
        (GOOD + 'name = "summary"\nwrite = "csv"', "and for the summary"),
        (GOOD.replace('"out"', '"."') + 'name = "clips/{clip}"\nwrite = "csv"', "an input"),
        (GOOD.replace("clips/*.csv", "none/*.csv"), "jobs[0].clips: files were expected, found n"),
        (GOOD.replace("clips/*.csv", ""), "jobs[0].clips: text was expected"),
        (GOOD.replace('"clips/*.csv"', '["clips/*.csv", "clips/take0.csv"]'), "each file once"),
        (GOOD.replace('clips = "clips/*.csv"\n', ""), "jobs[0].clips: a string or a list of"),
        (GOOD + GOOD[15:], "a file of its own was expected for each job"),
    ],
)  # fmt: skip
def test_bad_jobs_are_refused_with_file_and_field(tmp_path, capsys, text, sentence):
    jobs = make(tmp_path / "j", clips=2, faces=["core"])
    jobs.write_bytes(text if isinstance(text, bytes) else text.encode())
    assert main(["batch", str(jobs)]) == 1
    error = capsys.readouterr().err
    assert str(jobs) in error
    assert sentence in error
    assert error.count("\n") == 1
    assert not (jobs.parent / "out").exists()


def test_names_that_are_one_file_on_other_systems_collide(tmp_path):
    jobs = make(tmp_path / "j", clips=1, faces=["core"], table='write = "npz"\n')
    shutil.copy(tmp_path / "j" / "clips" / "take0.csv", tmp_path / "j" / "clips" / "TAKE0.csv")
    if len(list((tmp_path / "j" / "clips").iterdir())) == 1:  # a system of that kind
        return
    with pytest.raises(JobsError, match="a file of its own"):
        read_jobs(jobs)


@pytest.mark.skipif(os.name == "nt", reason="Windows has no files of these names")
def test_names_of_what_is_found_become_no_folders_and_no_devices(tmp_path):
    jobs = make(tmp_path / "j", clips=1, faces=["core"], table='write = "npz"\nname = "{clip}"\n')
    clips = tmp_path / "j" / "clips"
    hostile = ["x\\..\\..\\y", "CON", "a:b", "two\nlines", " .. ", "end. ", "n" * 240]
    for name in hostile:
        shutil.copy(clips / "take0.csv", clips / f"{name}.csv")
    plan = read_jobs(jobs)
    names = {job.clip.stem: job.name for job in plan.jobs}
    assert names.pop("take0") == "take0"
    assert {names[name] for name in hostile[:-1]} == {
        "x_.._.._y", "_CON", "a_b", "two_lines", "unnamed", "end",
    }  # fmt: skip
    assert names["n" * 240] == "n" * 199
    assert {path.parent for job in plan.jobs for _, path in job.outputs} == {plan.output}


def test_bad_command_lines_are_exit_code_2(tmp_path, capsys):
    assert main(["batch", str(tmp_path / "absent.toml")]) == 1
    assert "absent.toml: cannot read it" in capsys.readouterr().err
    assert main(["batch", str(tmp_path / "absent.toml"), "--workers", "0"]) == 2
    assert main(["batch", "x.toml", "--workers", "2", "--scheduler", "tcp://h:1"]) == 2


# ---- progress


class Terminal:
    def __init__(self, terminal):
        self.text, self._terminal = "", terminal

    def isatty(self):
        return self._terminal

    def write(self, text):
        self.text += text

    def flush(self):
        pass


def test_progress(monkeypatch):
    now = [0.0]
    monkeypatch.setattr("risorius.baking.progress.time.monotonic", lambda: now[0])
    for terminal in (True, False):
        now[0] = 0.0
        shown = Terminal(terminal)
        progress = Progress(40, "jobs", before=5, stream=shown)
        progress.update(6, 100)
        assert shown.text == ""  # no bar before the first interval
        now[0] = 20.0
        progress.update(15, 3000, "1 failed")
        line = "[#######.............] 15 of 40 jobs, 150 frames/s, 0:50 left, 1 failed"
        assert line in shown.text
        assert shown.text.startswith("\r" if terminal else "risorius: ")
        progress.say("so it is")
        assert shown.text.endswith("risorius: so it is\n")
    assert [clock(s) for s in (0, 59.6, 3661)] == ["0:00", "1:00", "1:01:01"]
