"""Brings virtual robots to OP with pysoem (SOEM), exchanges images, and checks them by value.

Run by the test binary `ethercat_net` inside a network namespace:

    pysoem_op.py INTERFACE ROBOTS ORDER dc|no-dc

ORDER is `little` or `big`. Offsets are typed from the manual's tables 4 to 28. Ends with status 0 and
a last line that begins with `passed:`; anything unexpected ends it with what was expected. The start
may be tried several times, since SOEM cannot wait for a busy machine; nothing after it may.
"""

import struct
import sys
import time

import pysoem

from checks import Unexpected, expect, expect_near

OUTPUT_LEN, INPUT_LEN = 60, 252
VENDOR, PRODUCT, REVISION = 0x00ECADE1, 0x0004D500, 1
# RobotControl, RobotStatus: bits of byte 0.
ACTIVATE, HOME = 1 << 1, 1 << 2
ACTIVATED, HOMED = 1 << 1, 1 << 2
SET_POINT = 1 << 0
MOVE_JOINTS, SET_CHECKPOINT = 1, 17
WATCHDOG_MS = 1000
CYCLE_S = 0.002
# Cycles after which something should have happened: far more than it takes.
PATIENCE = 20_000
SYNC_MANAGER_WATCHDOG = 0x1B


class Robot:
    """One robot's images, in the byte order of the test."""

    def __init__(self, number, slave, order):
        self.number = number
        self.slave = slave
        self.order = "<" if order == "little" else ">"
        self.outputs = bytearray(OUTPUT_LEN)

    def write(self, offset, kind, *values):
        struct.pack_into(self.order + kind, self.outputs, offset, *values)

    def read(self, offset, kind):
        values = struct.unpack_from(self.order + kind, self.slave.input, offset)
        return values[0] if len(values) == 1 else list(values)

    def command(self, move_id, command, *arguments):
        arguments = list(arguments) + [0.0] * (6 - len(arguments))
        self.write(4, "H", move_id)
        self.outputs[6] |= SET_POINT
        self.write(8, "I", command)
        self.write(12, "6f", *arguments)

    def echo(self):
        return self.read(8, "H")

    def joints(self):
        return self.read(16, "6f")


class Cell:
    def __init__(self, master, robots):
        self.master = master
        self.robots = robots
        self.exchanges_us = []

    def cycle(self, wait=True):
        for robot in self.robots:
            robot.slave.output = bytes(robot.outputs)
        begin = time.perf_counter()
        self.master.send_processdata()
        counter = self.master.receive_processdata(timeout=500_000)
        self.exchanges_us.append((time.perf_counter() - begin) * 1e6)
        if wait:
            time.sleep(CYCLE_S)
        return counter

    def cycle_until(self, what, is_there):
        for _ in range(PATIENCE):
            expect("working counter", self.cycle(), 3 * len(self.robots))
            if all(is_there(robot) for robot in self.robots):
                return
        states = [robot.slave.input.hex() for robot in self.robots]
        raise Unexpected(f"{what}: not after {PATIENCE} cycles; inputs {states}")

    def states(self):
        self.master.read_state()
        return [(robot.slave.state, robot.slave.al_status) for robot in self.robots]

    def to_op(self):
        """As the examples of SOEM do it: outputs first, then the request, then cycles."""
        for _ in range(10):
            self.cycle()
        self.master.state = pysoem.OP_STATE
        self.master.write_state()
        for _ in range(PATIENCE):
            self.cycle()
            if self.master.state_check(pysoem.OP_STATE, 2_000) == pysoem.OP_STATE:
                return
        raise Unexpected(f"not in OP: {self.states()}")


# What comes of an answer that took longer than SOEM's fixed limits (2 ms for a frame, 20 ms for a
# mailbox), as on a busy machine: an error, or the answer to the question before.
LATE = (Unexpected, pysoem.WkcError, pysoem.PacketError, pysoem.MailboxError,
        pysoem.ConfigMapError, pysoem.SdoInfoError)
# A mistake of the robots is in each of them.
ATTEMPTS = 5


def check_identity(slave):
    expect("SII identity", (slave.man, slave.id, slave.rev), (VENDOR, PRODUCT, REVISION))
    number = lambda sub: int.from_bytes(slave.sdo_read(0x1018, sub), "little")
    expect("object 1018h", (number(1), number(2), number(3)), (VENDOR, PRODUCT, REVISION))
    name = slave.sdo_read(0x1008, 0).rstrip(b"\0").decode()
    if not name.startswith("Meca500"):
        raise Unexpected(f"object 1008h: a Meca500 was expected, found {name!r}")
    return name


def mapped_bytes(slave, assignment):
    """Length of the process data by the mapping that the robot itself reports."""
    read = lambda index, sub: int.from_bytes(slave.sdo_read(index, sub), "little")
    bits = 0
    for pdo in range(1, read(assignment, 0) + 1):
        mapping = read(assignment, pdo)
        bits += sum(read(mapping, entry) & 0xFF for entry in range(1, read(mapping, 0) + 1))
    return bits / 8


def check_dictionary(slave):
    objects = {entry.index: entry for entry in slave.od}
    for index in (0x1000, 0x1008, 0x1018, 0x1C12, 0x1C13, 0x7310, 0x6010, 0x6015):
        if index not in objects:
            raise Unexpected(f"SDO information lists no object {index:04X}h")
    for index in (0x7310, 0x6015):
        names = [entry.name for entry in objects[index].entries]
        if not any(b"MoveID" in name.replace(b" ", b"") for name in names):
            raise Unexpected(f"SDO information of {index:04X}h names no MoveID: {names}")
    return len(objects)


def check_aborts(slave):
    for index, sub, code in ((0x2FFF, 0, 0x06020000), (0x1018, 99, 0x06090011)):
        try:
            slave.sdo_read(index, sub)
        except pysoem.SdoError as error:
            expect(f"abort code of {index:04X}h:{sub}", error.abort_code & 0xFFFFFFFF, code)
        else:
            raise Unexpected(f"{index:04X}h:{sub} can be read")


def exchange(cell):
    """Outputs that differ from robot to robot, and what each makes of its own."""
    cell.cycle_until("FifoSpace 13000", lambda robot: robot.read(10, "H") == 13000)
    for robot in cell.robots:
        expect("RobotStatus at the beginning", robot.slave.input[0] & (ACTIVATED | HOMED), 0)
        expect("MoveID at the beginning", robot.echo(), 0)
        # Firmware version in one slot, joint limits in the other, another slot for each robot.
        robot.write(36, "I", 1_800_000_000 + robot.number)
        robot.write(44 + 4 * (robot.number % 4), "I", 1)
        robot.write(44 + 4 * ((robot.number + 1) % 4), "I", 15)

    def slot(robot, index):
        return 140 + 28 * ((robot.number + index) % 4)

    cell.cycle_until(
        "dynamic types",
        lambda robot: (robot.read(slot(robot, 0), "I"), robot.read(slot(robot, 1), "I")) == (1, 15),
    )
    for robot in cell.robots:
        version = robot.read(slot(robot, 0) + 4, "6f")[:3]
        expect_near("firmware version", version, [11, 3, 84])
        limits = robot.read(slot(robot, 1) + 4, "6f")
        expect_near("joint limits", limits, [-170, -115, -36000, 170, 115, 36000])

    before = [robot.read(116, "2I") for robot in cell.robots]
    for robot in cell.robots:
        robot.outputs[0] |= ACTIVATE
    cell.cycle_until("Activated", lambda robot: robot.slave.input[0] & ACTIVATED)
    for robot in cell.robots:
        robot.outputs[0] = HOME
    cell.cycle_until("Homed", lambda robot: robot.slave.input[0] & HOMED)
    for robot, (seconds, micros) in zip(cell.robots, before):
        robot.outputs[0] = 0
        later = robot.read(116, "2I")
        if later <= [seconds, micros] or later[1] >= 1_000_000:
            raise Unexpected(f"RobotTimestamp: {later} does not follow {[seconds, micros]}")
        robot.outputs[6] = 1 << 3  # ResumeMotion: activation may leave the motion paused.
    cell.cycle_until("not paused", lambda robot: not robot.slave.input[12] & 1)

    targets = {robot: [10.0 + robot.number, -5, 5.5, 0.25, 20, -7] for robot in cell.robots}
    for robot in cell.robots:
        robot.outputs[6] = 0
        robot.command(1000 + robot.number, MOVE_JOINTS, *targets[robot])
    cell.cycle_until("MoveID echoed", lambda robot: robot.echo() == 1000 + robot.number)
    for robot in cell.robots:
        robot.command(2000 + robot.number, SET_CHECKPOINT, 100 + robot.number)
    cell.cycle_until("MoveID echoed", lambda robot: robot.echo() == 2000 + robot.number)
    cell.cycle_until("checkpoint", lambda robot: robot.read(4, "H") == 100 + robot.number)
    # Blending lets a checkpoint pass a little before the arm stands.
    cell.cycle_until("end of motion", lambda robot: robot.slave.input[12] & 1 << 2)
    for robot in cell.robots:
        expect_near(f"joints of robot {robot.number}", robot.joints(), targets[robot])
        expect("ErrorCode", robot.read(2, "H"), 0)
    return targets


def fall_and_return(cell, targets):
    """No outputs for longer than the watchdog: SAFE-OP with a reason, and OP again."""
    time.sleep(2.5 * WATCHDOG_MS / 1000)
    fallen = pysoem.SAFEOP_STATE | pysoem.STATE_ERROR
    expect("state", cell.states(), [(fallen, SYNC_MANAGER_WATCHDOG)] * len(cell.robots))
    # Inputs go on in SAFE-OP, outputs are not taken: one for each robot's inputs, two for outputs
    # that its memory takes all the same.
    cell.cycle()
    cell.master.state = pysoem.SAFEOP_STATE | pysoem.STATE_ACK
    cell.master.write_state()
    for _ in range(PATIENCE):
        cell.cycle()
        if {state for state, _ in cell.states()} == {pysoem.SAFEOP_STATE}:
            break
    for robot in cell.robots:
        robot.outputs[:] = bytes(OUTPUT_LEN)
    cell.to_op()
    cell.cycle_until("FifoSpace 13000", lambda robot: robot.read(10, "H") == 13000)
    for robot in cell.robots:
        expect_near("joints after the fall", robot.joints(), targets[robot])


def start(master, count):
    """From nothing to a mapped segment; what it found out about the robots."""
    expect("robots found", master.config_init(), count)
    names = {check_identity(slave) for slave in master.slaves}
    for slave in master.slaves:
        expect("mapped outputs", mapped_bytes(slave, 0x1C12), OUTPUT_LEN)
        expect("mapped inputs", mapped_bytes(slave, 0x1C13), INPUT_LEN)
    objects = check_dictionary(master.slaves[-1])
    check_aborts(master.slaves[0])
    for slave in master.slaves:
        slave.set_watchdog("processdata", WATCHDOG_MS)
    master.config_map()
    for slave in master.slaves:
        lengths = (len(slave.output), len(slave.input))
        expect("image lengths", lengths, (OUTPUT_LEN, INPUT_LEN))
    return names, objects


def main():
    interface, count, order, clock = sys.argv[1:]
    count = int(count)
    master = pysoem.Master()
    master.sdo_read_timeout = master.sdo_write_timeout = 5_000_000
    master.open(interface)
    try:
        begin = time.perf_counter()
        # A fresh start each time; whatever does not come from lateness stays as it was.
        for attempt in range(1, ATTEMPTS + 1):
            try:
                names, objects = start(master, count)
                break
            except LATE as error:
                print(f"attempt {attempt}: {error!r}", flush=True)
        else:
            raise Unexpected(f"no start in {ATTEMPTS} attempts")
        expect("distributed clocks", bool(master.config_dc()), clock == "dc")
        if clock == "dc":
            for slave in master.slaves:
                slave.dc_sync(True, 10_000_000)
        safe = master.state_check(pysoem.SAFEOP_STATE, 10_000_000)
        robots = [Robot(number, slave, order) for number, slave in enumerate(master.slaves)]
        cell = Cell(master, robots)
        expect("state before OP", safe, pysoem.SAFEOP_STATE)
        expect("expected working counter", master.expected_wkc, 3 * count)
        cell.to_op()
        started_s = time.perf_counter() - begin
        first_time = master.dc_time
        targets = exchange(cell)
        if clock == "dc" and master.dc_time <= first_time:
            raise Unexpected(f"the distributed clock stands still at {first_time}")
        fall_and_return(cell, targets)
        # Cycles back to back, for the figures.
        cell.exchanges_us.clear()
        for _ in range(1000):
            expect("working counter", cell.cycle(wait=False), 3 * count)
        cell.exchanges_us.sort()
        p50, p99 = cell.exchanges_us[500], cell.exchanges_us[990]
        master.state = pysoem.INIT_STATE
        master.write_state()
        expect("last state", master.state_check(pysoem.INIT_STATE, 5_000_000), pysoem.INIT_STATE)
    finally:
        master.close()
    print(
        f"passed: {count} of {sorted(names)}, {objects} objects, OP after {started_s:.2f} s, "
        f"exchange p50 {p50:.0f} us, p99 {p99:.0f} us"
    )


if __name__ == "__main__":
    main()
