"""Shots and frames on a farm: a real Dask scheduler and real workers on loopback."""

from __future__ import annotations

import os
import signal
import socketserver
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import dask
import pytest
import trustme
from any_clips import landscape
from distributed import Client
from edits import clip, external, movie, save, timeline
from farm_processes import Farm, farm, wait_for
from pieces import lie, noted, piece
from without_module import run_without

from palette4d.cli import main
from palette4d.common.errors import Palette4dError
from palette4d.jobs import dask_farm as farms
from palette4d.jobs.workers import Failed, Workers

TESTS = Path(__file__).resolve().parents[1]
GOLDEN = TESTS / "golden" / "sidecars"
EDITED = GOLDEN / "v1_edited.p4d.json"

SHOTS = 8


@pytest.fixture(scope="module")
def edit(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An edit of eight shots, a second or so of work each."""
    folder = tmp_path_factory.mktemp("edit")
    made = timeline()
    for i in range(SHOTS):
        take = movie(folder / f"t{i}.mov", 16, scene=lambda t, i=i: landscape(t + i / SHOTS))
        made.tracks[0].append(clip(f"t{i}", external(str(take)), 0, 16))
    return save(made, folder / "edit.otio")


@pytest.fixture(scope="module")
def here(edit: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """What one machine makes of the edit."""
    out = tmp_path_factory.mktemp("here") / "shots"
    assert main.main(["analyze", str(edit), "-o", str(out), "--jobs", "1", "--quiet"]) == 0
    return files(out)


def files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def start(*words: object) -> subprocess.Popen[str]:
    """Run the command in a session of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "palette4d", *map(str, words)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        # Where the tests run in the background, children inherit an ignored SIGINT.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )


def test_an_open_address_is_warned_of(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(farms, "ANSWERS_WITHIN", 0.1)
    for address, warned in (
        ("tcp://gone.invalid:8786", True),
        ("ws://gone.invalid:8786", True),
        ("tcp://127.0.0.1:9", True),
    ):
        with pytest.raises(Palette4dError):
            farms.run(address, piece, {0: 1}, lambda key, found: None)
        assert ("has no authentication" in capsys.readouterr().err) == warned


def certificates(folder: Path, authority: trustme.CA) -> dict[str, str]:
    """Dask's settings for a certificate of an authority, as docs/shots.md shows them."""
    folder.mkdir()
    paths = {name: str(folder / f"{name}.pem") for name in ("ca", "cert", "key")}
    own = authority.issue_cert("127.0.0.1")
    authority.cert_pem.write_to_path(paths["ca"])
    own.cert_chain_pems[0].write_to_path(paths["cert"])
    own.private_key_pem.write_to_path(paths["key"])
    settings = {
        f"distributed.comm.tls.{role}.{kind}": paths[kind]
        for role in ("scheduler", "worker", "client")
        for kind in ("cert", "key")
    }
    return settings | {"distributed.comm.tls.ca-file": paths["ca"]}


def test_with_certificates_nobody_else_gets_in(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    owner = certificates(tmp_path / "owner", trustme.CA())
    stranger = certificates(tmp_path / "stranger", trustme.CA())
    on_farm = {"distributed.comm.require-encryption": "True", **owner}
    on_farm["distributed.comm.default-scheme"] = "tls"
    variables = {
        "DASK_" + name.upper().replace(".", "__").replace("-", "_"): value
        for name, value in on_farm.items()
    }
    path = os.pathsep.join([str(TESTS), os.environ.get("PYTHONPATH", "")])
    monkeypatch.setattr(farms, "ANSWERS_WITHIN", 5)
    with farm(tmp_path / "farm", workers=1, PYTHONPATH=path, **variables) as made:
        assert made.address.startswith("tls://")
        plain = made.address.replace("tls://", "tcp://")
        for settings, address, words in (
            ({}, made.address, "found no certificates"),
            (stranger, made.address, "no Dask scheduler answers"),
            ({}, plain, "no Dask scheduler answers"),
        ):
            with dask.config.set(settings), pytest.raises(Palette4dError, match=words):
                farms.run(address, piece, {1: 1}, lambda key, result: None)
        found: dict[int, object] = {}
        monkeypatch.setattr(farms, "ANSWERS_WITHIN", 60)
        with dask.config.set(owner):
            farms.run(made.address, piece, {2: 2}, found.__setitem__)
    assert found == {2: (4, 1)}


def busy(client: Client, made: Farm, name: str) -> bool:
    """Whether a worker has work."""
    workers = client.scheduler_info(n_workers=-1)["workers"]
    address = next((a for a, worker in workers.items() if worker["name"] == name), None)
    return address is not None and bool(client.processing().get(address))


@pytest.mark.slow
def test_a_worker_that_dies_costs_its_shot_another_try(
    edit: Path, here: dict[str, bytes], tmp_path: Path
) -> None:
    out = tmp_path / "shots"
    with farm(tmp_path / "farm", workers=2) as made:
        with Client(made.address, set_as_default=False) as client:
            client.wait_for_workers(2, timeout=120)
            process = start("analyze", edit, "-o", out, "--quiet", "--cluster", made.address)
            wait_for(lambda: len(list(out.glob("*.p4d.json"))) >= 2, "the first shots")
            assert busy(client, made, "w0")
            made.kill(made.workers["w0"])
        _, err = process.communicate(timeout=300)
        assert process.returncode == 0, err
        assert made.workers["w1"].poll() is None
    assert files(out) == here


@pytest.mark.slow
def test_a_scheduler_that_dies_is_told(edit: Path, tmp_path: Path) -> None:
    out = tmp_path / "shots"
    with farm(tmp_path / "farm", workers=1) as made:
        process = start("analyze", edit, "-o", out, "--quiet", "--cluster", made.address)
        wait_for(lambda: list(out.glob("*.p4d.json")), "the first shot")
        made.kill(made.scheduler)
        _, err = process.communicate(timeout=300)
    assert process.returncode == 1
    assert "the farm's scheduler went away" in err
    assert "Traceback" not in err
    there = {path.name for path in out.glob("*.p4d.json")}
    assert 0 < len(there) < SHOTS
    # What is there stays; one machine does the rest.
    assert main.main(["analyze", str(edit), "-o", str(out), "--quiet"]) == 0
    assert len(list(out.glob("*.p4d.json"))) == SHOTS


def test_frames_on_a_farm_are_the_same_bytes(tmp_path: Path) -> None:
    words = ["export", str(EDITED), "--every", "7", "--size", "5", "--quiet"]
    assert main.main([*words, "-o", str(tmp_path / "here"), "--jobs", "1"]) == 0
    with farm(tmp_path / "farm", workers=1) as made:
        there = ["-o", str(tmp_path / "there"), "--cluster", made.address]
        assert main.main([*words, *there]) == 0
    assert files(tmp_path / "there") == files(tmp_path / "here")


@pytest.mark.slow
def test_ctrl_c_leaves_whole_files(edit: Path, tmp_path: Path) -> None:
    out = tmp_path / "shots"
    with farm(tmp_path / "farm", workers=2) as made:
        process = start("analyze", edit, "-o", out, "--quiet", "--cluster", made.address)
        wait_for(lambda: list(out.glob("*.p4d.json")), "the first shot")
        os.killpg(process.pid, signal.SIGINT)
        _, err = process.communicate(timeout=120)
    assert process.returncode == 130, err
    assert "palette4d: interrupted" in err
    assert "Traceback" not in err
    assert not [path for path in out.iterdir() if path.name.startswith(".")]


def test_a_worker_with_several_threads_does_one_piece_at_a_time(tmp_path: Path) -> None:
    path = os.pathsep.join(
        [str(Path(__file__).resolve().parents[1]), os.environ.get("PYTHONPATH", "")]
    )
    with farm(tmp_path / "farm", workers=0, PYTHONPATH=path) as made:
        made.add_worker("wide", threads=3)
        found: dict[int, object] = {}
        tasks = {i: i for i in (1, 2, 3, 6, 7)}
        Workers(cluster=made.address).run(piece, tasks, found.__setitem__)
        told: dict[int, object] = {}

        def take(key: int, answer: Any) -> None:
            told[key] = answer.text if isinstance(answer, Failed) else int(answer)

        Workers(cluster=made.address).run(lie, {i: i for i in (1, 2, 3, 4)}, take)
    assert (told[1], told[4]) == (1, 16)
    assert "ValueError" in str(told[2])
    assert "TypeError" in str(told[3])
    endless = found.pop(7)  # Dask cannot send such an error
    assert isinstance(endless, Failed)
    assert "RecursionError" in endless.text
    assert found == {1: (1, 3), 2: (4, 3), 3: Failed("three is refused"), 6: (36, 3)}


def test_a_worker_that_dies_while_it_is_asked_is_passed_over(tmp_path: Path) -> None:
    path = os.pathsep.join(
        [str(Path(__file__).resolve().parents[1]), os.environ.get("PYTHONPATH", "")]
    )
    with farm(tmp_path / "farm", workers=2, PYTHONPATH=path) as made:
        with Client(made.address, set_as_default=False) as client:
            client.wait_for_workers(2, timeout=120)
        # Halted, it takes the question and does not answer: its death then cuts the connection.
        made.workers["w0"].send_signal(signal.SIGSTOP)
        later = threading.Timer(1.5, made.kill, [made.workers["w0"]])
        later.start()
        found: dict[int, object] = {}
        Workers(cluster=made.address).run(piece, {1: 1, 2: 2}, found.__setitem__)
        later.join()
    assert found == {1: (1, 1), 2: (4, 1)}


def test_no_worker_yet_is_told_and_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = os.pathsep.join(
        [str(Path(__file__).resolve().parents[1]), os.environ.get("PYTHONPATH", "")]
    )
    monkeypatch.setattr(farms, "TOLD_AFTER", 0.5)
    with farm(tmp_path / "farm", workers=0, PYTHONPATH=path) as made:
        later = threading.Timer(1.5, made.add_worker, ["late"])
        later.start()
        found: dict[int, object] = {}
        Workers(cluster=made.address).run(piece, {2: 2}, found.__setitem__)
        later.join()
    assert found == {2: (4, 1)}
    told = capsys.readouterr().err
    assert told.count("has no worker yet") == 1
    assert f"`dask worker {made.address}`" in told


@pytest.mark.slow
def test_a_scheduler_that_dies_before_there_is_a_worker_is_told(tmp_path: Path) -> None:
    path = os.pathsep.join(
        [str(Path(__file__).resolve().parents[1]), os.environ.get("PYTHONPATH", "")]
    )
    with farm(tmp_path / "farm", workers=0, PYTHONPATH=path) as made:
        later = threading.Timer(1.5, made.kill, [made.scheduler])
        later.start()
        with pytest.raises(Palette4dError, match=r"scheduler at .* went away .*again"):
            Workers(cluster=made.address).run(piece, {2: 2}, {}.__setitem__)
        later.join()


@pytest.mark.parametrize("pause", [0, 2])  # after 2 seconds all are done, but only one is fetched
def test_a_farm_that_loses_all_workers_ends_with_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], pause: int
) -> None:
    path = os.pathsep.join(
        [str(Path(__file__).resolve().parents[1]), os.environ.get("PYTHONPATH", "")]
    )
    monkeypatch.setattr(farms, "WATCHED_EVERY", 0.2)
    monkeypatch.setattr(farms, "WORKERS_WITHIN", 5)
    with farm(tmp_path / "farm", workers=1, PYTHONPATH=path) as made:
        with Client(made.address, set_as_default=False) as client:
            client.wait_for_workers(1, timeout=120)
        found: dict[int, object] = {}

        def take(key: int, result: object) -> None:
            if not found:
                time.sleep(pause)
            found[key] = result
            made.kill(made.workers["w0"])

        Workers(cluster=made.address).run(noted, dict.fromkeys(range(9), str(tmp_path)), take)
    assert len(found) == 9
    lost = found[8]
    assert isinstance(lost, Failed)
    assert "no worker for 5 seconds" in lost.text
    assert "the farm has no worker any more" in capsys.readouterr().err


class TestRefusals:
    """What is said when there is no farm."""

    def test_nobody_answers(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(farms, "ANSWERS_WITHIN", 0.5)
        started = time.monotonic()
        # Nobody listens at port 9 (discard) of loopback. And palette4d starts no farm by itself:
        # everybody on this machine could run code through one.
        for address in ("127.0.0.1:9", "local:2"):
            with pytest.raises(Palette4dError, match=f"no Dask scheduler answers at {address}"):
                Workers(cluster=address).run(piece, {0: 1}, lambda key, outcome: None)
        assert time.monotonic() - started < 30

    def test_other_and_missing_palette4d_and_no_worker(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        (tmp_path / "sitecustomize.py").write_text("import sys; sys.modules['palette4d'] = None\n")
        path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
        with farm(tmp_path / "farm", workers=0) as made:

            def work() -> None:
                Workers(cluster=made.address).run(piece, {0: 1}, lambda key, found: None)

            with monkeypatch.context() as patch:
                patch.setattr(farms, "WORKERS_WITHIN", 0.5)
                with pytest.raises(Palette4dError, match=r"no worker for 0\.5 seconds"):
                    work()
            with monkeypatch.context() as patch:
                patch.setattr("palette4d._core.__version__", "99.0")
                with pytest.raises(Palette4dError, match=r"has palette4d .*, expected 99\.0"):
                    work()
            made.add_worker("bare", PYTHONPATH=path)
            with pytest.raises(Palette4dError, match=r"the worker .* cannot import palette4d"):
                work()

    def test_without_dask_the_error_says_what_to_install(self, tmp_path: Path) -> None:
        words = ["export", str(EDITED), "--every", "9", "-o", "out", "--cluster", "farm:8786"]
        done = run_without("distributed", tmp_path, *words)
        assert done.returncode == 1
        assert "pip install 'palette4d[farm]'" in done.stderr

    def test_what_is_no_scheduler(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(farms, "ANSWERS_WITHIN", 5)

        class Rubbish(socketserver.BaseRequestHandler):
            def handle(self) -> None:
                self.request.sendall(b"\x7f" * 64)
                self.request.recv(1)

        with socketserver.ThreadingTCPServer(("127.0.0.1", 0), Rubbish) as server:
            server.daemon_threads = True
            threading.Thread(target=server.serve_forever, daemon=True).start()
            address = "tcp://{}:{}".format(*server.server_address)
            with pytest.raises(Palette4dError, match="no Dask scheduler answers"):
                farms.run(address, piece, {0: 1}, lambda key, found: None)
            server.shutdown()

    @pytest.mark.parametrize("text", ["", "farm", "tcp://farm", "farm:", "a b:1", "inproc://x:1"])
    def test_addresses(self, text: str) -> None:
        with pytest.raises(Palette4dError, match="scheduler's address"):
            farms.check_address(text)

    def test_good_addresses(self) -> None:
        for text in ("tcp://farm:8786", "tls://10.0.0.1:8786", "farm:8786"):
            assert farms.check_address(text) == text
