"""What the scripts beside this one hold against what they find; anything unexpected ends a script with
what was expected."""

import math


class Unexpected(Exception):
    """Something is not as it must be."""


def expect(what, found, expected):
    if found != expected:
        raise Unexpected(f"{what}: expected {expected!r}, found {found!r}")


def expect_near(what, found, expected, by=0.01):
    near = len(found) == len(expected) and all(
        math.isclose(a, b, abs_tol=by) for a, b in zip(found, expected))
    if not near:
        raise Unexpected(f"{what}: expected {expected!r}, found {found!r}")
