"""What can go wrong between a NatNet server and us."""

from __future__ import annotations

from tcr_hardware.errors import HardwareError


class NatNetError(HardwareError):
    """Base of the errors of the NatNet client."""


class MalformedPacketError(NatNetError):
    """A packet is not what its header and version promise; nothing of it was used.

    Attributes:
        problem: What is wrong.
        offset: Byte of the payload at which it was noticed.
        size: Size of the payload [byte].
    """

    def __init__(self, problem: str, offset: int, size: int) -> None:
        super().__init__(f"malformed NatNet packet: {problem} at byte {offset} of {size}")
        self.problem = problem
        self.offset = offset
        self.size = size


class UnsupportedVersionError(NatNetError):
    """The server speaks a version whose packets are not known here, or refuses the one asked for.

    Attributes:
        version: Version of the server's stream, as text.
        allowed: Versions that can be read or were asked for, as text.
    """

    def __init__(self, version: str, allowed: str, *, hint: str) -> None:
        super().__init__(f"the server streams NatNet {version}, wanted {allowed}", hint=hint)
        self.version, self.allowed = version, allowed


class ServerSilentError(NatNetError):
    """The server did not answer in time.

    Attributes:
        address: Address of the server, ``host:port``.
        awaited: What was waited for.
        waited_s: How long [s].
    """

    def __init__(self, address: str, awaited: str, waited_s: float, *, hint: str = "") -> None:
        super().__init__(f"no {awaited} from {address} within {waited_s:g} s", hint=hint)
        self.address = address
        self.awaited = awaited
        self.waited_s = waited_s


class RequestRefusedError(NatNetError):
    """The server does not know a request, or answers it with nonsense.

    Attributes:
        request: The request.
        answer: What came back.
    """

    def __init__(self, request: str, answer: str) -> None:
        super().__init__(f"the NatNet server answers the request {request!r} with {answer}")
        self.request, self.answer = request, answer
