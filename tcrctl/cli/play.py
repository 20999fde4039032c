"""``tcrctl play LOG``: a run in the Foxglove app."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from tcrctl.cli.log_file import LogFile
from tcrctl.cli.options import unfolded

if TYPE_CHECKING:
    from tcrctl.view.server import ViewServer


Begin = Annotated[float | None, typer.Option("--from", metavar="SECONDS", help="First time played.")]


def _print_layout(wanted: bool) -> None:
    if not wanted:
        return
    from tcrctl.view.layout import layout

    print(layout(), end="")
    raise typer.Exit()


@dataclass(frozen=True)
class Playing:
    """What is played, and how."""

    rate: Annotated[float, typer.Option("--rate", "-r", metavar="X", help="Speed; 2 is twice as fast.")] = 1.0
    loop: Annotated[bool, typer.Option("--loop", "-l", help="Begin again at the end.")] = False
    begin: Begin = None
    end: Annotated[float | None, typer.Option("--to", metavar="SECONDS", help="Last time played.")] = None
    paused: Annotated[bool, typer.Option("--paused", help="Wait for the app to start it.")] = False
    once: Annotated[bool, typer.Option("--once", help="End after the last message.")] = False
    topics: Annotated[
        list[str] | None,
        typer.Option("--topic", metavar="NAME", help="Which topics; repeatable. Default: all."),
    ] = None


@unfolded
def play(
    log: LogFile,
    playing: Playing = Playing(),
    host: Annotated[
        str, typer.Option("--host", metavar="ADDRESS", help="Where to serve; 0.0.0.0 for everybody.")
    ] = "127.0.0.1",
    port: Annotated[
        int, typer.Option("--port", metavar="N", min=0, max=65535, help="Port; 0 takes a free one.")
    ] = 8765,
    print_layout: Annotated[
        bool,
        typer.Option(
            "--layout",
            help="Print a layout of the app's panels for it to import, and exit.",
            callback=_print_layout,
            is_eager=True,
        ),
    ] = False,
) -> None:
    """Play a log to the Foxglove app; nothing but pictures moves. Needs the package's extra 'view'.

    Playing begins when the app has connected. The app's time bar seeks, pauses and sets the speed, also after the
    end; Ctrl-C ends the program. The address is printed on stdout.

    Examples:
      tcrctl play logs/latest
      tcrctl play log.mcap --rate 5 --from 10 --loop
      tcrctl play --layout > tcrctl.foxglove.json
    """
    del print_layout
    from tcrctl.errors import RunInterruptedError
    from tcrctl.loop.interruption import Interruption
    from tcrctl.view.play import Playback
    from tcrctl.view.play import play as play_log

    playback = Playback(
        rate=playing.rate,
        begin=playing.begin,
        end=playing.end,
        loop=playing.loop,
        paused=playing.paused,
        once=playing.once,
        topics=playing.topics or (),
    )
    with Interruption() as interruption:
        try:
            play_log(
                log,
                playback,
                host=host,
                port=port,
                ready=_say_where,
                warn=_warn,
                check=interruption.check,
            )
        except RunInterruptedError as end_of_it:  # how it is meant to be ended
            raise typer.Exit(end_of_it.exit_code) from None


def _say_where(server: ViewServer) -> None:
    print(server.url, flush=True)
    print(f"waiting for the Foxglove app; open {server.app_url}", file=sys.stderr, flush=True)


def _warn(text: str) -> None:
    print(f"warning: {text}", file=sys.stderr, flush=True)
