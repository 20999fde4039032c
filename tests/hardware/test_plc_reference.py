"""What is handed to the person who programs the PLC: register map document and structured-text program."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from support.strict_types import TypeProblems
from support.structured_text import FunctionBlock
from tcr_hardware.emulators.plc_command import PlcCommand
from tcr_hardware.emulators.plc_limits import PlcLimitSettings
from tcr_hardware.emulators.plc_program import DEAD_CLOCK_SCANS, PlcProgram
from tcr_hardware.modbus.document import register_map_markdown
from tcr_hardware.modbus.registers import Control, FaultCode, Reject, Status, register_map
from tcr_hardware.servo import ServoSettings
from tcrctl.emulate.drives import MARGIN
from tcrctl.plant.rig.file import load_rig
from tcrctl.robot.description import load_robot

PLC = Path(__file__).parents[2] / "hardware" / "plc"
BLOCK = FunctionBlock((PLC / "tcr_plc.st").read_text())
MAP = register_map()
DT = 0.002
ON = Control.ENABLE | Control.RUN
FOLLOW = ON | Control.FOLLOW


def test_the_document_of_the_register_map_is_that_of_the_code():
    assert (PLC / "register_map.md").read_text() == register_map_markdown(MAP), (
        "python -m tcr_hardware.modbus.document > hardware/plc/register_map.md"
    )


def test_the_document_names_every_register_and_bit():
    text = register_map_markdown(MAP)
    for name in [
        *(row.name for row in MAP.registers),
        *(bit.name for bits in (Control, Status) for bit in bits),
    ]:
        assert f"`{name}`" in text
    for value in [*Reject, *FaultCode]:
        assert value.name.lower().replace("_", " ") in text.lower()


class BothPlcs:
    """Emulated program and structured text side by side, fed with the same commands and the same drives."""

    def __init__(self):
        self.emulated = PlcProgram(6, PlcLimitSettings(), ServoSettings(), zeroed=False)
        self.text = BLOCK.variables()
        self.text["CycleS"] = DT
        self.command = PlcCommand(Control(0), 0, (0,) * 6, 50_000.0, 0)
        self.measured, self.told = None, math.nan

    def write(self, control, setpoints, vmax=50_000):
        """A new set, into both."""
        before = self.command
        self.command = PlcCommand(
            control, (before.heartbeat + 1) & 0xFFFF, tuple(setpoints), float(vmax), (before.seq + 1) & 0xFFFF
        )
        registers = self.text["HR"]
        registers[0], registers[1] = int(control), self.command.heartbeat
        registers[14], registers[15] = vmax // 100, self.command.seq
        for axis, value in enumerate(setpoints):
            registers[2 + 2 * axis], registers[3 + 2 * axis] = value >> 16 & 0xFFFF, value & 0xFFFF

    def run(self, scans):
        """Run both; they have to agree after every scan."""
        program, text = self.emulated, self.text
        for _ in range(scans):
            text["EstopPressed"], text["DriveLost"] = program.estop, program.drive_lost
            told = (at if at == at else self.told for at in program.readings())
            text["ActualUm"] = dict(enumerate(told, start=1))
            text["CycleS"] = DT if self.measured is None else self.measured
            BLOCK.scan(text)
            program.scan(self.command, DT, self.measured)
            assert list(text["ActiveUm"].values()) == pytest.approx(program.active, abs=1e-9)
            registers = text["HR"]
            assert registers[100] & ~Status.IN_POSITION == program.status() & ~Status.IN_POSITION
            assert registers[101] == program.fault
            assert registers[102] == program.heartbeat_echo
            assert registers[103] == program.seq_ack
            assert registers[104] == program.reject[0] << 4 | program.reject[1]
            assert registers[105] == program.cycle


@pytest.fixture
def armed():
    both = BothPlcs()
    both.write(Control.ZERO, (0,) * 6)
    both.run(2)
    both.write(ON, (0,) * 6)
    both.run(2)
    assert both.emulated.enabled
    return both


def test_the_structured_text_fills_the_registers_that_a_bus_reads(armed):
    armed.run(1)
    registers = armed.text["HR"]
    assert (registers[120], registers[121]) == (0x5443, 1)
    assert (registers[122], registers[123]) == (0x0102, 0x0304)
    limits = PlcLimitSettings()
    assert registers[200] == limits.watchdog_ms
    for name, value in (
        ("MIN", limits.min_um),
        ("MAX", limits.max_um),
        ("VMAX_LIMIT", limits.vmax_um_s),
        ("STEPMAX", limits.step_max_um),
    ):
        row = MAP[name]
        for at in range(row.address, row.end, 2):
            assert (registers[at] << 16 | registers[at + 1]) == value & 0xFFFFFFFF


def test_positions_and_active_set_points_stand_where_the_map_says(armed):
    target = (1000, -2000, 3000, -4000, 5000, -1)
    for _ in range(4):
        armed.write(FOLLOW, target)
        armed.run(50)
    registers = armed.text["HR"]
    for name in ("ACT", "SP_ACTIVE"):
        row = MAP[name]
        words = [registers[at] << 16 | registers[at + 1] for at in range(row.address, row.end, 2)]
        assert [(word ^ 0x80000000) - 0x80000000 for word in words] == pytest.approx(target, abs=2)


def test_both_plcs_trip_stop_and_reset_alike(armed):
    for k in range(1, 8):
        armed.write(FOLLOW, (3_000 * k, -3_000 * k, 0, 0, 0, 0), 90_000)
        armed.run(20)
    armed.run(200)
    assert armed.emulated.fault is FaultCode.WATCHDOG
    armed.write(Control.RUN | Control.RESET, (0,) * 6)
    armed.run(5)
    armed.write(ON, (0,) * 6)
    armed.run(5)
    assert armed.emulated.enabled
    armed.emulated.servos[3].jammed = True
    for k in range(1, 8):
        armed.write(FOLLOW, (21_000, -21_000, 0, 2_000 * k, 0, 0), 90_000)
        armed.run(20)
    assert armed.emulated.fault is FaultCode.FOLLOWING_ERROR


def test_both_plcs_refuse_to_enable_before_the_zero_is_taken():
    both = BothPlcs()
    both.write(ON, (0,) * 6)
    both.run(3)
    assert not both.emulated.enabled
    assert Status.READY not in both.emulated.status()


@pytest.mark.parametrize("cause", ["estop", "drive_lost"])
def test_both_plcs_clear_a_fault_only_after_its_cause_is_gone(armed, cause):
    setattr(armed.emulated, cause, True)
    armed.run(2)
    for gone in (False, True):
        setattr(armed.emulated, cause, not gone)
        armed.write(Control.RUN, (0,) * 6)
        armed.run(2)
        armed.write(Control.RUN | Control.RESET, (0,) * 6)
        armed.run(2)
        assert (armed.emulated.fault is FaultCode.NONE) == gone


def moving(both):
    """Axis 1 on its way at 90 mm/s."""
    for k in range(1, 6):
        both.write(FOLLOW, (3_000 * k, 0, 0, 0, 0, 0), 90_000)
        both.run(16)


@pytest.mark.parametrize(
    "control", [Control.RUN | Control.ZERO, Control.RUN | Control.RESET, FOLLOW | Control.ZERO]
)
def test_both_plcs_ignore_zero_and_reset_while_a_drive_moves(armed, control):
    moving(armed)
    if Control.FOLLOW not in control:
        armed.emulated.drive_lost = True
        armed.run(1)
        armed.emulated.drive_lost = False
        armed.write(Control.RUN, (0,) * 6)
        armed.run(1)
    assert armed.emulated._moving()
    armed.write(control, (13_000, 0, 0, 0, 0, 0), 90_000)
    armed.run(60)
    assert armed.emulated.positions()[0] > 10_000


@pytest.mark.parametrize(
    ("setpoints", "vmax", "reject", "axis"),
    [
        ((0, 0, 95_001, 0, 0, 0), 50_000, Reject.RANGE, 3),
        ((0, 0, 0, 0, -35_001, 95_001), 50_000, Reject.RANGE, 5),
        ((0, 6_001, 0, 0, -6_001, 0), 50_000, Reject.STEP, 2),
        ((0,) * 6, 0, Reject.SPEED, 0),
        ((0,) * 6, 100_100, Reject.SPEED, 0),
        ((6_000,) * 6, 100_000, Reject.NONE, 0),
    ],
)
def test_both_plcs_judge_a_set_alike(armed, setpoints, vmax, reject, axis):
    armed.write(FOLLOW, (0,) * 6)
    armed.run(20)
    armed.write(FOLLOW, setpoints, vmax)
    armed.run(80)
    assert armed.emulated.reject == (reject, axis)


def test_both_plcs_forget_the_silence_before_they_were_enabled(armed):
    armed.write(Control.RUN, (0,) * 6)
    armed.run(99)
    armed.command = replace(armed.command, control=ON)  # the same heartbeat
    armed.text["HR"][0] = int(ON)
    armed.run(50)
    assert armed.emulated.enabled


positions = st.integers(-37_000, 97_000)
events = st.tuples(
    st.sampled_from(
        [
            "creep",
            "creep",
            "creep",
            "send",
            "hold",
            "stop",
            "silence",
            "estop",
            "drive",
            "jam",
            "reset",
            "arm",
            "zero",
        ]
    ),
    st.lists(positions, min_size=6, max_size=6),
    st.sampled_from([0, 5_000, 50_000, 90_000, 200_000]),
    st.integers(1, 30),
)


def act(both, what, wanted, vmax, scans):
    """One thing that happens on a bench."""
    program = both.emulated
    steps = [
        round(at) + max(-5_000, min(5_000, to - round(at)))
        for at, to in zip(program.active, wanted, strict=True)
    ]
    if what == "estop":
        program.estop = not program.estop
    elif what == "drive":
        program.drive_lost = not program.drive_lost
    elif what == "jam":
        program.servos[0].jammed = not program.servos[0].jammed
    elif what == "silence":
        both.run(110)
    controls = {
        "creep": FOLLOW,
        "send": FOLLOW,
        "hold": ON,
        "stop": Control.ENABLE,
        "reset": Control.RUN | Control.RESET,
        "arm": ON,
        "zero": Control.RUN | Control.ZERO,
    }
    if what == "arm":
        both.write(Control.RUN, steps, 50_000)
        both.run(1)
    if what in controls:
        both.write(controls[what], wanted if what == "send" else steps, vmax)
    both.run(scans)


@pytest.mark.slow
@settings(
    max_examples=40, phases=(Phase.explicit, Phase.generate)
)  # a difference is told at once, not made smaller
@given(st.lists(events, max_size=14))
def test_emulated_program_and_structured_text_agree_scan_by_scan_whatever_happens(script):
    both = BothPlcs()
    both.write(Control.ZERO, (0,) * 6)
    both.run(1)
    both.write(ON, (0,) * 6)
    both.run(1)
    for event in script:
        act(both, *event)


# ---- what compilers take ----


def test_strict_compilers_find_nothing_to_say_about_the_program():
    assert TypeProblems(BLOCK.tree).found == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("written", "instead", "problem"),
    [
        ("HR[105] := UINT_TO_WORD(Cycle);", "HR[105] := HR[105] + 1;", "+: WORD and DINT/INT/UINT"),
        ("Seq := HR[15];", "Seq := HR[15] * HR[15];", "*: WORD and WORD"),
        ("    HR : TCR_REGISTERS;", "    HR : ARRAY [0..229] OF WORD;", "HR: array of no named type"),
        (
            "    ActualUm : TCR_AXES;",
            "    ActualUm : ARRAY [1..6] OF LREAL;",
            "ActualUm: array of no named type",
        ),
        (
            "UINT_TO_LREAL(WORD_TO_UINT(HR[14]))",
            "WORD_TO_LREAL(HR[14])",
            "WORD_TO_LREAL: not in every edition",
        ),
        ("Reject := 16 * Verdict", "Reject := SHL(Verdict, 4)", "SHL: UINT"),
        ("IF Fault <> 0 THEN StatusBits", "IF Fault THEN StatusBits", "IF: UINT, not BOOL"),
        ("Control : WORD := 16#0000;", "Control : WORD := 0;", "Control in its declaration"),
        ("    SilenceS := 0.0;", "    SilenceS := 0;", "SilenceS :=: DINT/INT/UINT, not LREAL"),
    ],
)
def test_what_a_strict_compiler_stops_at_is_found(written, instead, problem):
    source = (PLC / "tcr_plc.st").read_text()
    assert written in source
    found = TypeProblems(FunctionBlock(source.replace(written, instead, 1)).tree).found
    assert any(problem in each for each in found), found


def test_the_limits_of_the_program_are_those_of_the_shipped_rig():
    """With the margin that the emulated bench has too: soft limits lie inside hard ones."""
    rig = load_rig("loopback", load_robot("tcr700")).rig
    registers = BLOCK.variables()
    BLOCK.scan(registers)
    limits = PlcLimitSettings()
    for mounted in rig.robots.values():
        for cable in mounted.cables.values():
            assert (1e3 * cable.min_mm - MARGIN, 1e3 * cable.max_mm + MARGIN) == (
                limits.min_um,
                limits.max_um,
            )
            assert 1e3 * cable.speed_limit_mm_s <= limits.vmax_um_s
    assert 1e3 * rig.safety.max_step_mm <= limits.step_max_um


# ---- power-up, clocks, numbers ----


def restart(both):
    """Power comes back; the registers hold what they held, the zero is remembered."""
    text, fresh = both.text, BLOCK.variables()
    kept = {name: text[name] for name in ("HR", "OriginUm", "Zeroed")}
    text |= {**fresh, **kept, "CycleS": DT}
    both.emulated.power_up()


@pytest.mark.slow
@pytest.mark.parametrize(
    "control", [FOLLOW, ON, Control(0x1F), FOLLOW | Control.RESET, Control.RUN | Control.ZERO, Control(0xFF)]
)
def test_a_program_that_starts_with_old_registers_enables_moves_and_zeroes_nothing(armed, control):
    moving(armed)
    armed.run(200)
    where, at = armed.emulated.positions()[0], armed.emulated.servos[0].position
    armed.text["HR"][0] = int(control)
    armed.command = replace(armed.command, control=control & Control(0x1F))
    restart(armed)
    armed.run(200)
    assert not armed.emulated.enabled
    assert armed.emulated.positions()[0] == where > 1000.0
    assert armed.emulated.servos[0].position == at
    for k in range(20):  # a host that goes on as if nothing had happened
        armed.write(control & Control(0x1F), (1_000 * k, 0, 0, 0, 0, 0))
        armed.run(10)
    assert not armed.emulated.enabled
    armed.write(Control.RUN, (0,) * 6)
    armed.run(2)
    armed.write(ON, (0,) * 6)
    armed.run(2)
    assert armed.emulated.enabled


@pytest.mark.slow
@pytest.mark.parametrize("measured", [0.0, -1.0, math.nan, -math.inf, math.inf, 1e300, 5e-324])
@pytest.mark.parametrize("then", [FOLLOW, Control.ENABLE, Control(0)])
def test_no_measured_time_makes_a_set_point_that_is_no_number(armed, measured, then):
    moving(armed)
    armed.measured = measured
    armed.run(3)
    armed.write(then, (16_000, 0, 0, 0, 0, 0), 90_000)
    armed.run(3)
    armed.measured = None
    armed.write(then, (16_000, 0, 0, 0, 0, 0), 90_000)
    before = armed.emulated.active[0]
    armed.run(1)
    assert abs(armed.emulated.active[0] - before) <= 90_000 * DT + 1e-9
    armed.run(50)
    assert all(map(math.isfinite, armed.text["SetpointUm"].values()))
    braking = 90_000**2 / (2 * PlcLimitSettings().deceleration_um_s2)
    assert 0.0 <= armed.emulated.active[0] <= 16_000.0 + braking


def test_a_clock_that_stands_still_is_a_fault_and_not_the_end_of_the_watchdog(armed):
    armed.write(FOLLOW, (0,) * 6)
    armed.measured = 0.0
    armed.run(DEAD_CLOCK_SCANS - 1)
    assert armed.emulated.enabled
    armed.run(1)
    assert (armed.emulated.fault, armed.emulated.enabled) == (FaultCode.CLOCK, False)


def test_a_clock_coarser_than_the_scan_is_none(armed):
    armed.write(FOLLOW, (1_000,) * 6)
    for k in range(50):
        armed.measured = 5 * DT if k % 5 == 4 else 0.0
        armed.run(1)
    assert armed.emulated.active == pytest.approx([1_000.0] * 6)
    assert armed.emulated.enabled


@pytest.mark.parametrize("told", [math.nan, math.inf, -1e300])
def test_an_encoder_that_tells_no_position_stops_the_drives_where_they_are(armed, told):
    moving(armed)
    armed.told = told
    armed.emulated.deaf = frozenset({1})
    armed.run(100)
    assert (armed.emulated.fault, armed.emulated.enabled) == (FaultCode.DRIVE, False)
    assert all(map(math.isfinite, armed.text["SetpointUm"].values()))
    armed.write(Control.RUN | Control.RESET, (0,) * 6)
    armed.run(2)
    assert armed.emulated.fault is FaultCode.DRIVE
    armed.emulated.deaf = frozenset()
    armed.write(Control.RUN, (0,) * 6)
    armed.run(2)
    armed.write(Control.RUN | Control.RESET, (0,) * 6)
    armed.run(2)
    assert armed.emulated.fault is FaultCode.NONE


def test_no_set_point_is_valid_before_every_encoder_has_told_where_its_drive_is(armed):
    moving(armed)
    armed.run(200)
    armed.emulated.deaf = frozenset({1})
    restart(armed)
    armed.run(5)
    assert not armed.text["SetpointValid"]
    armed.emulated.deaf = frozenset()
    armed.run(1)
    assert armed.text["SetpointValid"]
    assert armed.text["SetpointUm"][1] == pytest.approx(armed.emulated.servos[0].position)


@pytest.mark.parametrize("name", ["OriginUm", "ActiveUm", "TargetUm", "SpeedUmS", "LoadN"])
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_whatever_a_memory_holds_what_reaches_the_drives_is_a_number(name, value):
    text = BLOCK.variables() | {"CycleS": DT, "Zeroed": True, "LoadValid": True}
    for _ in range(3):
        BLOCK.scan(text)
    text[name][2] = value
    text["HR"][0], text["HR"][15] = int(FOLLOW), 1
    for k in range(20):
        text["HR"][1] = k
        BLOCK.scan(text)
        assert all(map(math.isfinite, text["SetpointUm"].values()))
    assert Status.READY not in Status(text["HR"][100] & sum(Status)) or math.isfinite(text["ActiveUm"][2])
