"""Drives a virtual robot with the vendor's package `mecademicpy`, as it is, and checks what comes of it by
value.

Run by the test binary `tcp_peers`:

    mecademicpy_drive.py ADDRESS

ADDRESS has the ports 10000 and 10001. Ends with status 0 and a last line that begins with `passed:`;
anything unexpected ends it with what was expected.
"""

import functools
import sys
import time

import mecademicpy.robot as mdr
from mecademicpy import mx_robot_def as mx

import checks
from checks import Unexpected, expect

# Far longer than anything takes.
PATIENCE_S = 60
CONNECT_S = 20
# What the robot says in four digits behind the point is off by half of the last one at most.
NEAR = 0.001


expect_near = functools.partial(checks.expect_near, by=NEAR)


def expect_raised(what, kind, act):
    try:
        act()
    except kind:
        return
    raise Unexpected(f"{what}: {kind.__name__} was not raised")


def wait_until(what, is_there):
    end = time.monotonic() + PATIENCE_S
    while not is_there():
        if time.monotonic() > end:
            raise Unexpected(f"{what}: not within {PATIENCE_S} s")
        time.sleep(0.01)


def joints_of(robot):
    return robot.GetRtTargetJointPos(synchronous_update=True, timeout=PATIENCE_S)


def standing(robot):
    """Where it stands once it has slowed down: the same place ten times."""
    end = time.monotonic() + PATIENCE_S
    place, times = joints_of(robot), 0
    while times < 10:
        time.sleep(0.01)
        before, place = place, joints_of(robot)
        times = times + 1 if place == before else 0
        if time.monotonic() > end:
            raise Unexpected(f"it moves on: {before!r}, {place!r}")
    return place


def pose_of(robot):
    return robot.GetRtTargetCartPos(synchronous_update=True, timeout=PATIENCE_S)


def status_of(robot):
    return robot.GetStatusRobot(synchronous_update=True, timeout=PATIENCE_S)


def connect(robot, address, **how):
    robot.Connect(address, timeout=CONNECT_S, disconnect_on_exception=False, **how)
    robot.WaitConnected(timeout=PATIENCE_S)


def wake(robot):
    robot.ActivateRobot()
    robot.WaitActivated(timeout=PATIENCE_S)
    expect("homed before Home", status_of(robot).homing_state, False)
    robot.Home()
    robot.WaitHomed(timeout=PATIENCE_S)
    status = status_of(robot)
    expect("activated and homed", (status.activation_state, status.homing_state), (True, True))
    expect("error", status.error_status, False)


def check_identity(robot):
    info = robot.GetRobotInfo()
    expect("model", info.robot_model, mx.MxRobotModel.MX_ROBOT_MODEL_M500_R3)
    expect("joints", info.num_joints, 6)
    version = info.version
    expect("firmware", (version.major, version.minor, version.patch), (11, 3, 84))
    expect("serial number", info.serial, "87654321")


def check_moves(robot):
    robot.SetJointVel(100)
    robot.SetCartLinVel(500)
    robot.MoveJoints(10, 5, -5, 7, 20, 30)
    robot.WaitIdle(timeout=PATIENCE_S)
    expect_near("MoveJoints", joints_of(robot), [10, 5, -5, 7, 20, 30])
    robot.MoveJointsRel(-10, 5, 0, 0, 0, -30)
    robot.WaitIdle(timeout=PATIENCE_S)
    expect_near("MoveJointsRel", joints_of(robot), [0, 10, -5, 7, 20, 0])
    robot.MovePose(190, 0, 300, 0, 90, 0)
    robot.WaitIdle(timeout=PATIENCE_S)
    expect_near("MovePose", pose_of(robot), [190, 0, 300, 0, 90, 0])
    robot.MoveLin(190, 40, 280, 0, 90, 0)
    robot.WaitIdle(timeout=PATIENCE_S)
    expect_near("MoveLin", pose_of(robot), [190, 40, 280, 0, 90, 0])
    robot.MoveLinRelWrf(10, -40, 20, 0, 0, 0)
    robot.WaitIdle(timeout=PATIENCE_S)
    expect_near("MoveLinRelWrf", pose_of(robot), [200, 0, 300, 0, 90, 0])
    # The tool looks along x: 10 mm of its z axis go there.
    robot.MoveLinRelTrf(0, 0, -10, 0, 0, 0)
    robot.WaitIdle(timeout=PATIENCE_S)
    expect_near("MoveLinRelTrf", pose_of(robot), [190, 0, 300, 0, 90, 0])


def check_frames(robot):
    robot.SetTrf(0, 0, 20, 0, 0, 0)
    robot.WaitIdle(timeout=PATIENCE_S)
    expect_near("the pose of a longer tool", pose_of(robot), [210, 0, 300, 0, 90, 0])
    robot.SetWrf(10, 0, 100, 0, 0, 0)
    robot.WaitIdle(timeout=PATIENCE_S)
    expect_near("the pose in another frame", pose_of(robot), [200, 0, 200, 0, 90, 0])
    robot.SetTrf(0, 0, 0, 0, 0, 0)
    robot.SetWrf(0, 0, 0, 0, 0, 0)
    robot.WaitIdle(timeout=PATIENCE_S)


def check_velocities(robot):
    robot.MoveJoints(0, 0, 0, 0, 20, 0)
    robot.WaitIdle(timeout=PATIENCE_S)
    robot.SetVelTimeout(0.2)
    # The robot stops by itself 0.2 s later, far from where it could not go on.
    robot.MoveJointsVel(20, 0, 0, 0, 0, 0)
    robot.WaitIdle(timeout=PATIENCE_S)
    joints = joints_of(robot)
    if not 1 < joints[0] < 20:
        raise Unexpected(f"MoveJointsVel for 0.2 s at 20 deg/s: joint 1 is at {joints[0]}")
    expect_near("the other joints", joints[1:], [0, 0, 0, 20, 0])
    before = pose_of(robot)
    robot.MoveLinVelWrf(0, 0, -40, 0, 0, 0)
    robot.WaitIdle(timeout=PATIENCE_S)
    after = pose_of(robot)
    if not 2 < before[2] - after[2] < 40:
        raise Unexpected(f"MoveLinVelWrf for 0.2 s at -40 mm/s: z went {before[2]} to {after[2]}")
    expect_near("x and y", after[:2], before[:2], by=0.01)
    robot.MoveLinVelTrf(0, 0, 0, 0, 0, 20)
    robot.WaitIdle(timeout=PATIENCE_S)
    expect_near("turned about its own axis", pose_of(robot)[:3], after[:3], by=0.01)


def check_checkpoints(robot):
    robot.MoveJoints(0, 0, 0, 0, 0, 0)
    first = robot.SetCheckpoint(1)
    robot.MoveJoints(5, 0, 0, 0, 0, 0)
    second = robot.SetCheckpoint(2)
    robot.WaitForAnyCheckpoint(timeout=PATIENCE_S)
    first.wait(timeout=PATIENCE_S)
    second.wait(timeout=PATIENCE_S)
    expect_near("behind the second", joints_of(robot), [5, 0, 0, 0, 0, 0])


def check_pause(robot):
    # 25 s long, unless it is paused and cleared.
    robot.SetJointVel(2)
    robot.MoveJoints(60, 0, 0, 0, 0, 0)
    lost = robot.SetCheckpoint(3)
    wait_until("it sets off", lambda: joints_of(robot)[0] > 5.1)
    robot.PauseMotion()
    robot.WaitMotionPaused(timeout=PATIENCE_S)
    expect("paused", status_of(robot).pause_motion_status, True)
    paused_at = standing(robot)
    robot.ResumeMotion()
    robot.WaitMotionResumed(timeout=PATIENCE_S)
    wait_until("it goes on", lambda: joints_of(robot)[0] > paused_at[0] + 0.1)
    robot.ClearMotion()
    robot.WaitMotionCleared(timeout=PATIENCE_S)
    expect_raised("the checkpoint behind", mdr.InterruptException,
                  lambda: lost.wait(timeout=PATIENCE_S))
    if joints_of(robot)[0] > 59:
        raise Unexpected("ClearMotion came too late or did nothing")
    robot.ResumeMotion()
    robot.WaitMotionResumed(timeout=PATIENCE_S)
    robot.SetJointVel(100)
    robot.MoveJoints(0, 0, 0, 0, 0, 0)
    robot.WaitIdle(timeout=PATIENCE_S)
    expect_near("cleared and resumed", joints_of(robot), [0, 0, 0, 0, 0, 0])


def check_error(robot):
    # Joint 2 ends at 90 degrees.
    robot.MoveJoints(0, 120, 0, 0, 0, 0)
    robot.WaitForError(timeout=PATIENCE_S)
    expect("error", status_of(robot).error_status, True)
    expect_raised("WaitIdle in error", mdr.InterruptException,
                  lambda: robot.WaitIdle(timeout=PATIENCE_S))
    robot.ResetError()
    robot.WaitErrorReset(timeout=PATIENCE_S)
    expect("error after ResetError", status_of(robot).error_status, False)
    robot.ResumeMotion()
    robot.WaitMotionResumed(timeout=PATIENCE_S)
    robot.MoveJoints(0, 10, 0, 0, 0, 0)
    robot.WaitIdle(timeout=PATIENCE_S)
    expect_near("after the error", joints_of(robot), [0, 10, 0, 0, 0, 0])


def check_variables(robot):
    robot.CreateVariable("speed", 12.5, cyclic_id=10001, timeout=PATIENCE_S)
    robot.CreateVariable("place", [1.0, 2.0, 3.0], timeout=PATIENCE_S)
    wait_until("the variables are known", lambda: robot.GetVariable("place") is not None)
    expect("a variable", robot.GetVariable("speed").get_value(), 12.5)
    expect("an array", list(robot.GetVariable("place").get_value()), [1, 2, 3])
    expect("by its cyclic ID", robot.GetVariableByCyclicId(10001).name, "speed")
    robot.SetVariable("speed", 30, timeout=PATIENCE_S)
    wait_until("the variable changes", lambda: robot.GetVariable("speed").get_value() == 30)
    expect_raised("a variable that is none", mdr.CommandFailedException,
                  lambda: robot.SetVariable("nowhere", 1, timeout=PATIENCE_S))
    robot.DeleteVariable("speed", timeout=PATIENCE_S)
    wait_until("the variable is gone", lambda: robot.GetVariable("speed") is None)
    expect("what is left", sorted(robot.ListVariables()), ["place"])


def check_monitor(robot, address):
    monitor = mdr.Robot()
    connect(monitor, address, monitor_mode=True)
    try:
        expect("a monitor controls", monitor.IsControlling(), False)
        robot.MoveJoints(15, 10, 0, 0, 10, 0)
        robot.WaitIdle(timeout=PATIENCE_S)
        goal = [15, 10, 0, 0, 10, 0]

        def has_seen():
            seen = monitor.GetRtTargetJointPos(synchronous_update=False)
            return all(abs(a - b) < NEAR for a, b in zip(seen, goal))

        wait_until("the monitor sees the move", has_seen)
        status = monitor.GetStatusRobot(synchronous_update=False)
        expect("what the monitor knows", (status.activation_state, status.homing_state),
               (True, True))
        expect_raised("a monitor's move", mdr.DisconnectError,
                      lambda: monitor.MoveJoints(0, 0, 0, 0, 0, 0))
    finally:
        monitor.Disconnect()
    expect_near("the robot obeys no monitor", joints_of(robot), goal)


def check_second(address):
    second = mdr.Robot()
    expect_raised("a second controller", mdr.CommunicationError,
                  lambda: connect(second, address))
    second.Disconnect()


def check_lost(robot, address):
    robot.SetJointVel(2)
    robot.MoveJoints(80, 0, 0, 0, 0, 0)
    wait_until("it sets off", lambda: joints_of(robot)[0] > 15.1)
    robot.Disconnect()
    robot.WaitDisconnected(timeout=PATIENCE_S)
    connect(robot, address)
    status = status_of(robot)
    expect("it stays activated and homed", (status.activation_state, status.homing_state),
           (True, True))
    expect("it pauses without its controller", status.pause_motion_status, True)
    stopped_at = standing(robot)
    if not 15 < stopped_at[0] < 80:
        raise Unexpected(f"joint 1 stopped at {stopped_at[0]}")
    robot.ClearMotion()
    robot.ResumeMotion()
    robot.WaitMotionResumed(timeout=PATIENCE_S)
    robot.SetJointVel(100)
    robot.MoveJoints(0, 0, 0, 0, 0, 0)
    robot.WaitIdle(timeout=PATIENCE_S)
    expect_near("connected again", joints_of(robot), [0, 0, 0, 0, 0, 0])


def main():
    address = sys.argv[1]
    robot = mdr.Robot()
    connect(robot, address)
    try:
        expect("it controls", robot.IsControlling(), True)
        steps = [
            check_identity, wake, check_moves, check_frames, check_velocities, check_checkpoints,
            check_pause, check_error, check_variables,
            lambda robot: check_monitor(robot, address),
            lambda robot: check_second(address),
            lambda robot: check_lost(robot, address),
        ]
        for step in steps:
            step(robot)
        robot.DeactivateRobot()
        robot.WaitDeactivated(timeout=PATIENCE_S)
        expect("deactivated", status_of(robot).activation_state, False)
    finally:
        robot.Disconnect()
    print(f"passed: {len(steps)} steps")


if __name__ == "__main__":
    try:
        main()
    except Unexpected as unexpected:
        sys.exit(str(unexpected))
