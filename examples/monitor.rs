//! Watches a robot: a virtual Meca500 on a link in memory, one bus cycle a millisecond by the
//! system's clock, its joints printed ten times a second for two seconds.
//!
//! Joint positions and time scaling are not part of the fixed image: they are dynamic data, which
//! the engine asks for in the slots of the image as long as somebody is subscribed.
//!
//! ```console
//! $ cargo run --example monitor
//! ```

use std::error::Error;

use fieldarm::cycle::{CyclicLink, InputQuality};
use fieldarm::engine::meca500::{Config, Engine, Event};
use fieldarm::link::clock::MonotonicClock;
use fieldarm::link::direct::DirectLink;
use fieldarm::sim::meca500::{RobotSettings, VirtualRobot};
use fieldarm::time::Duration;
use fieldarm::wire::meca500::command::MotionCommand;
use fieldarm::wire::meca500::dynamic::DynamicType;
use fieldarm::wire::meca500::image::{INPUT_LEN, OUTPUT_LEN};

const PERIOD: Duration = Duration::from_millis(1);
const CYCLES: u32 = 2_000;
const CYCLES_PER_PRINT: u32 = 100;

fn main() -> Result<(), Box<dyn Error>> {
    let robot = VirtualRobot::new(RobotSettings { homed: true, ..RobotSettings::default() });
    let mut link = DirectLink::new(robot);
    let mut engine = Engine::<64>::new(Config::default());
    engine.subscribe(DynamicType::ACTUAL_JOINT_POSITION)?;
    engine.subscribe(DynamicType::TIME_SCALING)?;

    let (mut outputs, mut inputs) = ([0; OUTPUT_LEN], [0; INPUT_LEN]);
    let mut quality = InputQuality::Lost;
    let clock = MonotonicClock::new();
    let mut deadline = clock.now();
    for cycle in 1..=CYCLES {
        // Deadlines lie on a grid: a late cycle does not push the next ones back.
        deadline += PERIOD;
        let now = clock.sleep_until(deadline);
        engine.cycle_bytes(now, quality, &inputs, &mut outputs)?;
        quality = link.exchange(now, &outputs, &mut inputs)?;

        while let Some(event) = engine.poll_event() {
            println!("{event:?}");
            if let Event::Connected { .. } = event {
                // Something to look at: both go out as soon as the robot can take them.
                engine.bring_up()?;
                engine.submit(MotionCommand::MoveJoints([40.0, 10.0, 0.0, 0.0, -20.0, 0.0]))?;
            }
        }
        if cycle.is_multiple_of(CYCLES_PER_PRINT)
            && let Some(joints) = engine.dynamic(DynamicType::ACTUAL_JOINT_POSITION)
            && let Some(scaling) = engine.dynamic(DynamicType::TIME_SCALING)
        {
            let [theta1, theta2, theta3, theta4, theta5, theta6] = joints.value.values();
            let [percent, ..] = scaling.value.values();
            println!(
                "{theta1:8.2} {theta2:8.2} {theta3:8.2} {theta4:8.2} {theta5:8.2} {theta6:8.2} deg  \
                 at {percent:3.0} %, {:?} old",
                joints.age
            );
        }
    }
    Ok(())
}
