"""Owns a virtual robot over EtherNet/IP with the scanner `ethernetip`, exchanges images, and checks
them by value.

Run by the test binary `enip_peers`:

    ethernetip_scan.py ADDRESS ORDER SECONDS

ORDER is `little` or `big`. Offsets are typed from the manual's tables 4 to 28. Ends with status 0 and
a last line that begins with `passed:`; anything unexpected ends it with what was expected.
"""

import struct
import sys
import time

import ethernetip

from checks import Unexpected, expect, expect_near

OUTPUT_LEN, INPUT_LEN = 60, 252
INPUT_ASSEMBLY, OUTPUT_ASSEMBLY, CONFIG_ASSEMBLY = 100, 150, 151
VENDOR, DEVICE_TYPE, PRODUCT_CODE = 1565, 43, 500
RPI_MS = 10
# 4 << 4: a watchdog of 640 ms, since busy machines stall.
MULTIPLIER = 4
# RobotControl, RobotStatus: bits of byte 0.
ACTIVATE, HOME = 1 << 1, 1 << 2
ACTIVATED, HOMED = 1 << 1, 1 << 2
SET_POINT = 1 << 0
MOVE_JOINTS = 1
OWNERSHIP_CONFLICT = 0x0106
# Far longer than anything takes.
PATIENCE_S = 30
# This scanner rounds its interval up to 8 ms; it asks for 10.
NAP_S = 0.02


class Robot:
    """The images, which this scanner keeps as lists of bits that its own threads send and fill."""

    def __init__(self, order, inputs, outputs):
        self.order = "<" if order == "little" else ">"
        self.inputs = inputs
        self.outputs = outputs

    def write(self, offset, kind, *values):
        for index, byte in enumerate(struct.pack(self.order + kind, *values)):
            for bit in range(8):
                self.outputs[8 * (offset + index) + bit] = bool(byte >> bit & 1)

    def read(self, offset, kind):
        size = struct.calcsize(self.order + kind)
        bits = self.inputs[8 * offset:8 * (offset + size)]
        data = bytes(sum(int(bits[8 * i + b]) << b for b in range(8)) for i in range(size))
        values = struct.unpack(self.order + kind, data)
        return values[0] if len(values) == 1 else list(values)

    def status(self):
        return self.read(0, "B")

    def wait(self, what, is_there):
        # A reading may be torn: the list is filled bit by bit. So it must hold twice.
        end = time.monotonic() + PATIENCE_S
        times = 0
        while times < 2:
            times = times + 1 if is_there() else 0
            if time.monotonic() > end:
                raise Unexpected(f"{what}: not within {PATIENCE_S} s")
            time.sleep(NAP_S)


def check_identity(scanner, connection):
    listed = scanner.listIDUDP(timeout=5)
    if listed is None:
        raise Unexpected("ListIdentity over UDP: no answer")
    found = (listed.vendor_id, listed.device_type, listed.product_code)
    expect("ListIdentity over UDP", found, (VENDOR, DEVICE_TYPE, PRODUCT_CODE))
    expect("RegisterSession", connection.registerSession(), 0)
    numbers = []
    for attribute in (1, 2, 3):
        status, data = connection.getAttrSingle(0x01, 1, attribute)
        expect(f"status of identity attribute {attribute}", status, 0)
        numbers.append(int.from_bytes(data[:2], "little"))
    expect("identity object", tuple(numbers), (VENDOR, DEVICE_TYPE, PRODUCT_CODE))
    status, data = connection.getAttrSingle(0x01, 1, 7)
    expect("product name", data[1:1 + data[0]], b"Meca500")
    status, _ = connection.getAttrSingle(0x99, 1, 1)
    if status == 0:
        raise Unexpected("an attribute of class 99h can be read")


def open_connection(connection, port):
    return connection.sendFwdOpenReq(
        INPUT_ASSEMBLY, OUTPUT_ASSEMBLY, CONFIG_ASSEMBLY, torpi=RPI_MS, otrpi=RPI_MS,
        multiplier=MULTIPLIER, inputsz=INPUT_LEN, outputsz=OUTPUT_LEN, originator_udp_port=port)


def exchange(robot, seconds):
    robot.wait("FifoSpace 13000", lambda: robot.read(10, "H") == 13000)
    expect("RobotStatus at the beginning", robot.status() & (ACTIVATED | HOMED), 0)
    # Firmware version in one slot, joint limits in the other.
    robot.write(36, "I", 1_800_000_000)
    robot.write(44, "I", 1)
    robot.write(48, "I", 15)
    robot.wait("dynamic types", lambda: (robot.read(140, "I"), robot.read(168, "I")) == (1, 15))
    expect_near("firmware version", robot.read(144, "3f"), [11, 3, 84])
    expect_near("joint limits", robot.read(172, "6f"), [-170, -115, -36000, 170, 115, 36000])

    robot.write(0, "B", ACTIVATE)
    robot.wait("Activated", lambda: robot.status() & ACTIVATED)
    robot.write(0, "B", HOME)
    robot.wait("Homed", lambda: robot.status() & HOMED)
    robot.write(0, "B", 0)

    moves = 0
    end = time.monotonic() + seconds
    while moves < 2 or time.monotonic() < end:
        moves += 1
        goal = [10.0 * (moves % 3), 5.0, -5.0, 7.0, -12.5, 30.0]
        # SetPoint last: a frame may leave between two bits.
        robot.write(8, "I", MOVE_JOINTS)
        robot.write(12, "6f", *goal)
        robot.write(4, "H", moves)
        robot.write(6, "B", SET_POINT)
        robot.wait(f"MoveID {moves}", lambda: robot.read(8, "H") == moves)
        robot.write(6, "B", 0)
        robot.wait(
            f"joints of move {moves}",
            lambda: all(abs(a - b) < 0.01 for a, b in zip(robot.read(16, "6f"), goal)))
    return moves


def main():
    address, order, seconds = sys.argv[1], sys.argv[2], float(sys.argv[3])
    scanner = ethernetip.EtherNetIP(address)
    connection = scanner.explicit_conn()
    check_identity(scanner, connection)
    inputs = scanner.registerAssembly(
        ethernetip.EtherNetIP.ENIP_IO_TYPE_INPUT, INPUT_LEN, INPUT_ASSEMBLY, connection)
    outputs = scanner.registerAssembly(
        ethernetip.EtherNetIP.ENIP_IO_TYPE_OUTPUT, OUTPUT_LEN, OUTPUT_ASSEMBLY, connection)
    scanner.startIO(0)
    try:
        expect("Forward Open", open_connection(connection, scanner.originator_udp_port), 0)
        expect("APIs in ms", (connection.otapi, connection.toapi), (RPI_MS, RPI_MS))
        connection.produce()
        moves = exchange(Robot(order, inputs, outputs), seconds)
        second = scanner.explicit_conn()
        # Every connection of this scanner begins with the same serial number.
        second.conn_serial_num += 100
        expect("RegisterSession of a second owner", second.registerSession(), 0)
        refused = open_connection(second, scanner.originator_udp_port)
        expect("extended status of a second owner", refused, OWNERSHIP_CONFLICT)
        second.unregisterSession()
    finally:
        # Its threads would keep the process alive.
        connection.stopProduce()
        scanner.stopIO()
    closed = connection.sendFwdCloseReq(INPUT_ASSEMBLY, OUTPUT_ASSEMBLY, CONFIG_ASSEMBLY)
    expect("Forward Close", closed, 0)
    connection.unregisterSession()
    print(f"passed: {connection.seqnum} frames sent, {moves} moves")


if __name__ == "__main__":
    try:
        main()
    except Unexpected as unexpected:
        sys.exit(str(unexpected))
