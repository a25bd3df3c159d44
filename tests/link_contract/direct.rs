//! The contract of [`DirectLink`]: a robot in the same process, without a bus in between.

use fieldarm::cycle::{CyclicDevice, CyclicLink};
use fieldarm::link::direct::DirectLink;
use fieldarm::sim::meca500::RobotSettings;
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::meca500::image::{INPUT_LEN, OUTPUT_LEN};

use crate::cell::CYCLE;
use crate::contract::{Ability, Bus, BusKind, Cable, PlcEnd};
use crate::link_contract;
use crate::watched::WatchedRobot;

/// No bus.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Direct;

/// A link to a robot in the same process.
pub(crate) struct DirectBus {
    link: DirectLink<WatchedRobot>,
}

/// A device with the inputs of a robot that lacks one PDO.
struct Shorter;

impl CyclicDevice for Shorter {
    const OUTPUT_LEN: usize = OUTPUT_LEN;
    const INPUT_LEN: usize = 248;

    fn cycle(&mut self, _: Instant, _: Option<&[u8]>, _: &mut [u8]) {}

    fn is_on_bus(&self) -> bool {
        true
    }
}

impl BusKind for Direct {
    type Bus = DirectBus;

    fn inability(self, ability: Ability) -> Option<&'static str> {
        Some(match ability {
            Ability::LoseImages | Ability::LoseOneWay | Ability::NoticeLostOutputs => {
                "images are handed over, not carried"
            }
            Ability::LeaveByCommand => "there is no bus to leave",
        })
    }

    fn cycles_per_command(self) -> u64 {
        1
    }

    fn open(self, robot: RobotSettings) -> Result<DirectBus, String> {
        Ok(DirectBus { link: DirectLink::new(WatchedRobot::new(robot)) })
    }

    fn refusal(self) -> (Result<(), String>, &'static [&'static str]) {
        let mut link = DirectLink::new(Shorter);
        let refused = link.exchange(Instant::ZERO, &[0; OUTPUT_LEN], &mut [0; INPUT_LEN]);
        (refused.map(drop).map_err(|error| error.to_string()), &["248", "252", "inputs"])
    }
}

impl Bus for DirectBus {
    type Link = DirectLink<WatchedRobot>;

    fn link(&mut self) -> &mut Self::Link {
        &mut self.link
    }

    fn robot(&mut self) -> &mut WatchedRobot {
        self.link.device_mut()
    }

    fn set_cable(&mut self, cable: Cable) {
        assert_eq!(cable, Cable::In, "there is no other");
    }

    fn restart_plc(self, _: PlcEnd, now: Instant, away: Duration) -> Result<Self, String> {
        let mut robot = self.link.into_device();
        let mut at = now;
        while at < now + away {
            at += CYCLE;
            robot.cycle(at, None, &mut [0; INPUT_LEN]);
        }
        Ok(Self { link: DirectLink::new(robot) })
    }
}

link_contract!(direct, crate::direct::Direct);

#[test]
fn it_can_do_nothing_that_needs_a_bus() {
    let cannot = Ability::ALL.map(|ability| Direct.inability(ability).is_some());
    assert_eq!(cannot, [true; 4]);
}
