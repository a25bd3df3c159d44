"""Cycles virtual robots with pysoem (SOEM) and prints what the exchanges took.

Run by the bench `ethercat` inside a network namespace:

    pysoem_cycle.py INTERFACE ROBOTS PERIOD_US WARM_UP CYCLES

Prints `exchange_ns` with the time of each exchange, from outputs in hand to inputs in hand, then
`overruns` (deadlines that passed without a cycle) and `lost` (a wrong working counter).
"""

import gc
import sys
import time

import pysoem

OUTPUT_LEN, INPUT_LEN = 60, 252
# A robot that gets no outputs for so long falls; a busy machine may not run us for a while.
WATCHDOG_MS = 1000
# Cycles after which the robots should be in OP: far more than it takes.
PATIENCE = 20_000


def to_op(master):
    for slave in master.slaves:
        slave.set_watchdog("processdata", WATCHDOG_MS)
    master.config_map()
    for slave in master.slaves:
        if (len(slave.output), len(slave.input)) != (OUTPUT_LEN, INPUT_LEN):
            raise SystemExit(f"images of {len(slave.output)} and {len(slave.input)} bytes")
    if master.state_check(pysoem.SAFEOP_STATE, 10_000_000) != pysoem.SAFEOP_STATE:
        raise SystemExit("not in SAFE-OP")
    for _ in range(10):
        master.send_processdata()
        master.receive_processdata(timeout=500_000)
    master.state = pysoem.OP_STATE
    master.write_state()
    for _ in range(PATIENCE):
        master.send_processdata()
        master.receive_processdata(timeout=500_000)
        if master.state_check(pysoem.OP_STATE, 2_000) == pysoem.OP_STATE:
            return
    raise SystemExit("not in OP")


def measure(master, period_ns, warm_up, cycles):
    slaves = master.slaves
    outputs = bytes(OUTPUT_LEN)
    expected = 3 * len(slaves)
    taken, overruns, lost = [0] * cycles, 0, 0
    now = time.monotonic_ns
    gc.collect()
    gc.disable()
    deadline = now()
    for cycle in range(-warm_up, cycles):
        began = now()
        while began < deadline:
            time.sleep((deadline - began) / 1e9)
            began = now()
        missed = (began - deadline) // period_ns
        deadline += (missed + 1) * period_ns
        began = now()
        for slave in slaves:
            slave.output = outputs
        master.send_processdata()
        counter = master.receive_processdata(timeout=500_000)
        for slave in slaves:
            slave.input
        took = now() - began
        if cycle >= 0:
            taken[cycle] = took
            overruns += missed
            lost += counter != expected
    return taken, overruns, lost


def main():
    interface, count, period_us, warm_up, cycles = sys.argv[1:]
    master = pysoem.Master()
    master.sdo_read_timeout = master.sdo_write_timeout = 5_000_000
    master.open(interface)
    try:
        found = master.config_init()
        if found != int(count):
            raise SystemExit(f"{found} robots found")
        to_op(master)
        taken, overruns, lost = measure(
            master, int(period_us) * 1000, int(warm_up), int(cycles)
        )
    finally:
        master.close()
    print("exchange_ns", *taken)
    print("overruns", overruns)
    print("lost", lost)


if __name__ == "__main__":
    main()
