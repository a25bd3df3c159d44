"""Owns an adapter over EtherNet/IP with the scanner `ethernetip` and produces until told to end.

    ethernetip_cycle.py ADDRESS INTERVAL_MS

Run by the bench `enip`, which measures the frames. Ends when its standard input does.
"""

import sys

import ethernetip

OUTPUT_LEN, INPUT_LEN = 60, 252


def main():
    address, interval_ms = sys.argv[1], int(sys.argv[2])
    # Without this it never sends faster than every 8 ms.
    ethernetip.ethernetip.config.UDP_IO_MIN_RPI = 1
    scanner = ethernetip.EtherNetIP(address)
    connection = scanner.explicit_conn()
    if connection.registerSession() != 0:
        sys.exit("no session")
    for kind, size, instance in (
            (ethernetip.EtherNetIP.ENIP_IO_TYPE_INPUT, INPUT_LEN, 100),
            (ethernetip.EtherNetIP.ENIP_IO_TYPE_OUTPUT, OUTPUT_LEN, 150)):
        scanner.registerAssembly(kind, size, instance, connection)
    scanner.startIO(0)
    opened = connection.sendFwdOpenReq(
        100, 150, 151, torpi=interval_ms, otrpi=interval_ms, multiplier=7,
        inputsz=INPUT_LEN, outputsz=OUTPUT_LEN, originator_udp_port=scanner.originator_udp_port)
    if opened != 0:
        sys.exit(f"Forward Open: {opened}")
    connection.produce()
    sys.stdin.read()
    # The meter is gone by now: nobody is there to be told.
    connection.stopProduce()
    scanner.stopIO()


if __name__ == "__main__":
    main()
