//! An integrator's own loop, from a robot without power to a robot without power: bring up, three
//! moves and a checkpoint, an error on purpose, recovery, deactivation.
//!
//! Nothing here waits inside the loop. Each event of the engine decides what to ask for next, and
//! the bus goes on meanwhile. Time is simulated: on a machine, wait for the next period instead.
//!
//! ```console
//! $ cargo run --example own_loop
//! ```

use std::error::Error;

use fieldarm::cycle::{CyclicLink, InputQuality};
use fieldarm::engine::meca500::{Action, Config, Engine, Event};
use fieldarm::link::direct::DirectLink;
use fieldarm::sim::meca500::{RobotSettings, VirtualRobot};
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::meca500::command::{MotionCommand, Pose};
use fieldarm::wire::meca500::image::{INPUT_LEN, OUTPUT_LEN};

/// The number by which this cell knows that a part was placed; the engine keeps 7000 to 7999.
const PART_PLACED: u16 = 1;
const PERIOD: Duration = Duration::from_millis(2);
const TIME_LIMIT: Instant = Instant::from_millis(60_000);

fn main() -> Result<(), Box<dyn Error>> {
    let mut link = DirectLink::new(VirtualRobot::new(RobotSettings::default()));
    let mut engine = Engine::<64>::new(Config::default());
    let (mut outputs, mut inputs) = ([0; OUTPUT_LEN], [0; INPUT_LEN]);
    let (mut now, mut quality) = (Instant::ZERO, InputQuality::Lost);
    while now < TIME_LIMIT {
        now += PERIOD;
        engine.cycle_bytes(now, quality, &inputs, &mut outputs)?;
        quality = link.exchange(now, &outputs, &mut inputs)?;
        while let Some(event) = engine.poll_event() {
            println!("{:6} ms  {event:?}", now.as_nanos() / 1_000_000);
            if react(&mut engine, event)? {
                return Ok(());
            }
        }
    }
    Err("the robot did not get there in time".into())
}

/// What the cell does about an event; true when everything is over.
fn react(engine: &mut Engine<64>, event: Event) -> Result<bool, Box<dyn Error>> {
    match event {
        Event::Connected { .. } => engine.bring_up()?,
        Event::ActionDone(Action::BringUp) => {
            engine.submit(MotionCommand::MoveJoints([0.0, 0.0, 0.0, 0.0, 30.0, 0.0]))?;
            engine.submit(MotionCommand::MoveJointsRel([30.0, 0.0, 0.0, 0.0, 0.0, 0.0]))?;
            engine.submit(MotionCommand::MoveJointsRel([0.0, 20.0, -10.0, 0.0, 0.0, 0.0]))?;
            engine.submit(MotionCommand::SetCheckpoint(PART_PLACED))?;
        }
        // Everything before the checkpoint is executed. Now for something no Meca500 reaches.
        Event::CheckpointReached { number: PART_PLACED } => {
            let far_away = Pose { x: 900.0, y: 0.0, z: 300.0, alpha: 0.0, beta: 90.0, gamma: 0.0 };
            engine.submit(MotionCommand::MovePose(far_away))?;
        }
        // What was under way ends as aborted. The code decides whether going on makes sense.
        Event::RobotError { code } => {
            println!("           {code:?} is the error we asked for: recovering");
            engine.recover()?;
        }
        Event::ActionDone(Action::Recover) => engine.request(Action::Deactivate)?,
        Event::ActionDone(Action::Deactivate) => return Ok(true),
        Event::ActionFailed { action, fault } => {
            return Err(format!("{action:?} failed: {fault:?}").into());
        }
        Event::ConnectionLost { .. } | Event::Fault(_) => return Err(format!("{event:?}").into()),
        _ => {}
    }
    Ok(false)
}
