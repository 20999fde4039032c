"""Which version the frames have: the server's own in multicast, agreed upon in unicast from Motive 3 on."""

from __future__ import annotations

from tcr_hardware.natnet.errors import UnsupportedVersionError
from tcr_hardware.natnet.protocol import NEWEST, OLDEST, PINNED, Version
from tcr_hardware.natnet.settings import NatNetSettings

#: Questions without an answer before the version is taken for agreed; the strict decoder notices if it is not.
TRIES = 4


class VersionChoice:
    """Agrees with the server on the version of the frames.

    Attributes:
        stream: Version of the frames; None until it is settled.
        asked: Version that we ask for, or None to take the server's own.
        pending: Whether questions are open.
    """

    def __init__(self, settings: NatNetSettings) -> None:
        self._settings = settings
        self._configured = None if settings.bitstream is None else Version.parse(settings.bitstream)
        self.stream: Version | None = None
        self.asked: Version | None = None if settings.multicast else self._configured
        self.pending = False
        self._own = OLDEST
        self._tries = self._set_requests = 0

    def server_speaks(self, version: Version) -> None:
        """Decide what to ask of a server whose own version is ``version``.

        Raises:
            UnsupportedVersionError: Its frames cannot be read, and it cannot be asked for others.
        """
        self._own, self.stream = version, None
        can_choose = not self._settings.multicast and version >= (4, 0)
        wanted = self._configured
        if wanted is None and version > NEWEST and not self._settings.allow_newer and can_choose:
            wanted = PINNED
        if wanted not in (None, version) and not can_choose:
            raise UnsupportedVersionError(
                str(version),
                str(wanted),
                hint="Only Motive 3 and newer, in unicast, can stream another version.",
            )
        self.asked = wanted
        if can_choose:
            self._open()
        else:
            self._settle(version)

    def ask_again(self) -> None:
        """Find out which version the server has changed to."""
        if not self._settings.multicast and self._own >= (4, 0):
            self._open()

    def questions(self) -> list[str]:
        """Return the requests to send now; after ``TRIES`` give up and take the version for agreed."""
        self._tries += 1
        if self._tries > TRIES:
            self.pending = False
            self._settle(self.asked or self._own)
            return []
        if self.asked is None:
            return ["Bitstream"]
        self._set_requests += 1
        return [f"Bitstream,{self.asked}", "Bitstream"]

    def answered(self, understood: bool, payload: bytes) -> bool:
        """Take an answer of the server; return whether it belongs here.

        Raises:
            UnsupportedVersionError: The server does not stream what it was asked for.
        """
        text = payload.partition(b"\0")[0].decode("ascii", "replace")
        if understood and text.startswith("Bitstream,"):
            self._told(text.partition(",")[2])
            return True
        if self.pending and not understood:
            self.pending = False
            if self.asked is not None:
                raise self._refused(str(self._own))
            self._settle(self._own)
            return True
        if self._set_requests and understood:
            self._set_requests -= 1
            return True
        return False

    def _open(self) -> None:
        self.pending = True
        self._tries = 0
        self._set_requests = 0

    def _told(self, text: str) -> None:
        try:
            version = Version.parse(text)
        except ValueError:
            return
        if self.asked not in (None, version):
            if self._tries >= TRIES:
                self.pending = False
                raise self._refused(str(version))
            return
        self.pending, self._set_requests = False, 0
        self._settle(version)

    def _settle(self, version: Version) -> None:
        if version < OLDEST or (version > NEWEST and not self._settings.allow_newer):
            raise UnsupportedVersionError(
                str(version),
                f"{OLDEST} to {NEWEST}",
                hint="Ask for an older bit stream (unicast, bitstream: 4.1), or set allow_newer to try it.",
            )
        self.stream = version

    def _refused(self, version: str) -> UnsupportedVersionError:
        return UnsupportedVersionError(
            version,
            str(self.asked),
            hint="The server does not change its bit stream; see Motive's streaming pane.",
        )
