"""The view of a run, live and played back, as a client of the protocol sees it."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest
from mcap.reader import make_reader

from support import records
from support.log_files import STOP, open_log
from support.short_runs import ROOT, arguments, short_spec
from support.viewer_client import ViewerClient, digest
from tcrctl.cli.app import main
from tcrctl.errors import InputError, RunInterruptedError, UnknownNameError
from tcrctl.experiment.prepare import prepare
from tcrctl.experiment.run import run_experiment
from tcrctl.log.viewer_topics import TOPICS
from tcrctl.view.live import LiveView
from tcrctl.view.play import Playback, Player, play
from tcrctl.view.tape import Tape

N_STEPS = 60
FIRST_NS = records.EPOCH_NS
LAST_NS = records.EPOCH_NS + round(1e9 * (N_STEPS - 1) * records.PERIOD_S)


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / "log.mcap"
    with open_log(path, flush_steps=10) as writer:
        for k in range(N_STEPS):
            writer.step(records.record(k))
        writer.finish(STOP)
    return path


def written(path, topic):
    """Log times and digests of the contents of a topic in a file."""
    with open(path, "rb") as stream:
        messages = [message for _, _, message in make_reader(stream).iter_messages(topic)]
    return [(message.log_time, digest(message.data)) for message in messages]


class Playing:
    """``play`` in a thread of its own, with the port it listens at; ends with the ``with`` body."""

    def __init__(self, path, **options):
        self._ready, self._stop, self.failure = threading.Event(), threading.Event(), None
        self._thread = threading.Thread(target=self._run, args=(path, Playback(**options)), daemon=True)

    def _run(self, path, playback):
        try:
            play(path, playback, port=0, ready=self._note, check=self._check)
        except RunInterruptedError:
            pass
        except BaseException as failure:
            self.failure = failure

    def _note(self, server):
        self.url = server.url
        self._ready.set()

    def _check(self):
        if self._stop.is_set():
            raise RunInterruptedError(2, "SIGINT")

    def __enter__(self):
        self._thread.start()
        assert self._ready.wait(20), self.failure
        return self

    def __exit__(self, *_):
        self._stop.set()
        self.join()

    def join(self):
        self._thread.join(20)
        assert not self._thread.is_alive()
        assert self.failure is None


@pytest.mark.slow
def test_a_client_receives_every_message_of_a_log_played_five_times_as_fast(log):
    begin = time.monotonic()
    with Playing(log, rate=5.0, once=True) as playing, ViewerClient(playing.url) as client:
        client.subscribe(count=len(TOPICS) + 3)
        playing.join()
        took = time.monotonic() - begin
        for topic in (*TOPICS, "/log", "/tcrctl/step", "/tcrctl/event"):
            assert client.of(topic) == written(log, topic), topic
        assert client.info["capabilities"]
        assert client.states[-1]["status"] == "Ended"
    assert took > (LAST_NS - FIRST_NS) / 5e9


@pytest.mark.slow
def test_the_time_bar_pauses_seeks_and_sets_the_speed(log):
    middle = FIRST_NS + 1_500_000_000
    with Playing(log, paused=True) as playing, ViewerClient(playing.url) as client:
        client.subscribe("/tf", "/scene", "/scene/static")
        client.wait(lambda: client.states)
        assert client.states[0]["status"] == "Paused"
        time.sleep(0.3)
        assert not client.of("/tf")
        answer = client.control(play=False, seek=middle, name="seek")
        assert (answer["status"], answer["now"], answer["jumped"]) == ("Paused", middle, True)
        there = max(m for m in written(log, "/tf") if m[0] <= middle)
        client.wait(lambda: client.of("/scene") and client.of("/tf")[-1:] == [there])
        assert client.of("/scene/static")[0][1] == written(log, "/scene/static")[0][1]
        seen = len(client.of("/tf"))
        assert client.control(play=True, rate=4.0, name="go")["rate"] == 4.0
        client.wait(lambda: client.states[-1]["status"] == "Ended")
        assert client.of("/tf")[seen:] == [m for m in written(log, "/tf") if m[0] > middle]
        client.control(play=True, rate=20.0, name="again")
        client.wait(
            lambda: client.of("/tf")[-1][0] == LAST_NS and client.of("/tf").count(written(log, "/tf")[0]) == 1
        )


@pytest.mark.slow
def test_a_late_viewer_gets_what_is_written_once(log):
    with Playing(log, paused=True) as playing, ViewerClient(playing.url) as first:
        first.subscribe("/log")
        first.wait(lambda: first.states)
        first.control(play=False, seek=LAST_NS - 1)
        with ViewerClient(playing.url) as late:
            late.subscribe("/scene/static", "/tf")
            late.wait(lambda: late.of("/scene/static") and late.of("/tf"))


class Recorder:
    """Stands for the server: notes what was sent, and when."""

    def __init__(self, clock):
        self.sent, self._clock = [], clock

    def send(self, topic, time_ns, data):
        self.sent.append((self._clock(), topic, time_ns))

    def refresh(self): ...

    def forget(self): ...

    def tell_time(self, time_ns): ...

    def tell_state(self, state): ...


class FakeTime:
    def __init__(self):
        self.now = 0.0

    def clock(self):
        return self.now

    def sleep(self, seconds):
        self.now += seconds


@pytest.mark.parametrize("rate", [0.5, 1.0, 3.0])
@pytest.mark.parametrize("whole", [True, False])
def test_messages_are_sent_when_they_are_due(log, tmp_path, rate, whole):
    path = log
    if not whole:
        path = tmp_path / "cut.mcap"
        path.write_bytes(log.read_bytes()[: log.stat().st_size * 2 // 3])
    time_, begin = FakeTime(), 0.5
    recorder, playback = Recorder(time_.clock), Playback(rate, begin, 1.2, once=True)
    Player(Tape(path, ["/tf"]), playback, clock=time_.clock, sleep=time_.sleep).run(recorder)
    paced = [(at, ns) for at, topic, ns in recorder.sent if topic == "/tf" and ns > FIRST_NS + 0.5e9]
    assert [ns for _, ns in paced] == [FIRST_NS + k * 50_000_000 for k in range(11, 25)]
    for at, ns in paced:
        assert at == pytest.approx(((ns - FIRST_NS) / 1e9 - begin) / rate, abs=1e-6)


def test_a_loop_begins_again(log):
    time_ = FakeTime()
    recorder, turns = Recorder(time_.clock), []

    def stop_after_three():
        turns[:] = [ns for _, topic, ns in recorder.sent if topic == "/tf" and ns == FIRST_NS]
        if len(turns) == 3:
            raise RunInterruptedError(2, "SIGINT")

    player = Player(
        Tape(log, ["/tf"]), Playback(loop=True), clock=time_.clock, sleep=time_.sleep, check=stop_after_three
    )
    with pytest.raises(RunInterruptedError):
        player.run(recorder)
    assert time_.now == pytest.approx(2 * (LAST_NS - FIRST_NS) / 1e9, abs=0.1)


def test_what_cannot_be_played_is_an_error(log, tmp_path, capsys):
    with pytest.raises(UnknownNameError, match="/backbone"):
        Tape(log, ["/backbones"])
    for options in ({"rate": 0.0}, {"rate": float("nan")}, {"begin": 99.0}, {"begin": 2.0, "end": 1.0}):
        with pytest.raises(InputError):
            Player(Tape(log), Playback(**options))
    assert main(["play", str(tmp_path / "none.mcap")]) == 2
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert main(["play", str(log), "--port", str(port)]) == 5
    assert f"127.0.0.1:{port}" in capsys.readouterr().err


def test_without_the_extra_the_error_says_how_to_get_it(log, tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "foxglove", None)
    for command in (["play", str(log)], ["run", "letter_t", "--view", "--out", str(tmp_path / "runs")]):
        assert main(command) == 2
        assert "pip install 'tcrctl[view]'" in capsys.readouterr().err
    assert not (tmp_path / "runs").exists()


@pytest.mark.slow
def test_the_command_prints_its_address_and_ends_with_ctrl_c(log):
    command = [sys.executable, "-m", "tcrctl.cli.app", "play", str(log), "--port", "0"]
    environment = {**os.environ, "PYTHONPATH": f"{ROOT}:{ROOT / 'hardware'}"}
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
    ) as process:
        url = process.stdout.readline().strip()
        with ViewerClient(url) as client:
            client.subscribe("/tip/reference")
            client.wait(lambda: client.of("/tip/reference"))
        process.send_signal(signal.SIGINT)
        assert process.wait(20) == 130
        assert "app.foxglove.dev" in process.stderr.read()


@pytest.fixture(scope="module")
def short():
    return prepare(short_spec())


@pytest.mark.slow
def test_a_live_view_shows_what_the_log_holds(short, tmp_path):
    with LiveView("letter_t", port=0) as live, ViewerClient(live.url) as client:
        client.subscribe(count=len(TOPICS) + 2)
        assert live.wait_for_viewer(10)
        time.sleep(0.2)
        summary = run_experiment(short, out=tmp_path, tap=live.tap)
        assert summary.status == "success"
        for topic in (*TOPICS, "/tcrctl/step"):
            expected = written(summary.log, topic)
            client.wait_for(topic, len(expected))
            assert client.of(topic) == expected, topic
    assert live.failure is None


@pytest.mark.slow
def test_the_command_shows_a_run_while_it_runs(tmp_path, capsys):
    assert main(["run", "letter_t", *arguments(), "--view", "--view-port", "0", "--out", str(tmp_path)]) == 0
    assert "live view at ws://127.0.0.1:" in capsys.readouterr().err


@pytest.mark.slow
def test_a_view_that_fails_does_not_end_the_run(short, tmp_path, monkeypatch):
    with LiveView("letter_t", port=0) as live:
        calls = []

        def broken(*message):
            calls.append(message)
            raise OSError("gone")

        monkeypatch.setattr(live, "send", broken)
        assert run_experiment(short, out=tmp_path, tap=live.tap).status == "success"
    assert len(calls) == 1
    assert str(live.failure) == "gone"


@pytest.mark.slow
def test_a_viewer_that_stops_reading_holds_nothing_up():
    """More than server and network can hold: the oldest are dropped, and sending stays quick."""
    with (
        LiveView("letter_t", port=0) as live,
        socket.create_connection(("127.0.0.1", int(live.url.split(":")[-1]))) as s,
    ):
        handshake = (
            "GET / HTTP/1.1",
            "Host: x",
            "Upgrade: websocket",
            "Connection: Upgrade",
            "Sec-WebSocket-Version: 13",
            "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
            "Sec-WebSocket-Protocol: foxglove.sdk.v1",
            "",
            "",
        )
        s.sendall("\r\n".join(handshake).encode())
        with ViewerClient(live.url) as client:
            client.subscribe("/tcrctl/step")
            assert live.wait_for_viewer(10)
            number = client.channels["/tcrctl/step"]["id"]
        subscribe = f'{{"op":"subscribe","subscriptions":[{{"id":1,"channelId":{number}}}]}}'.encode()
        masked = bytes([0x81, 0x80 | len(subscribe), 0, 0, 0, 0]) + subscribe
        s.sendall(masked)
        time.sleep(0.3)
        took = []
        for k in range(25000):
            begin = time.perf_counter()
            live.tap("/tcrctl/step", k, bytes(1000))
            took.append(time.perf_counter() - begin)
    assert live.failure is None
    assert np.quantile(took, 0.99) < 2e-3


def test_the_listener_of_a_run_answers_no_playback_request():
    with LiveView("letter_t", port=0) as live:
        assert live._listener.on_playback_control_request(SimpleNamespace()) is None
